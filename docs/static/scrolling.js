// A table that is wider than the page scrolls; the keyboard must reach it.
function makeTablesFocusable() {
  for (const table of document.querySelectorAll("table.table")) {
    if (table.scrollWidth > table.clientWidth) table.tabIndex = 0;
    else table.removeAttribute("tabindex");
  }
}
addEventListener("load", makeTablesFocusable);
addEventListener("resize", makeTablesFocusable);
