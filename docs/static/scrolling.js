// A table or an equation that is wider than the page scrolls; the keyboard must reach it.
function makeScrollingFocusable() {
  for (const wide of document.querySelectorAll("table.table, .equation")) {
    if (wide.scrollWidth > wide.clientWidth) wide.tabIndex = 0;
    else wide.removeAttribute("tabindex");
  }
}
addEventListener("load", makeScrollingFocusable);
addEventListener("resize", makeScrollingFocusable);
