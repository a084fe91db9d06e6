// A table or an equation that is wider than the page scrolls; the keyboard must reach it, and columns of text need not
// be as narrow as their longest word.
function makeScrollingFocusable() {
  for (const wide of document.querySelectorAll("table.table, .equation")) {
    wide.classList.remove("scrolling");
    wide.classList.toggle("scrolling", wide.scrollWidth > wide.clientWidth);
    if (wide.scrollWidth > wide.clientWidth) wide.tabIndex = 0;
    else wide.removeAttribute("tabindex");
  }
}
addEventListener("load", makeScrollingFocusable);
addEventListener("resize", makeScrollingFocusable);
