// A table or an equation that is wider than the page scrolls; the keyboard must reach it, and its cells of text need not
// be as narrow as their longest word.
const LONG_TEXT = 20, TEXT_WIDTH = "10rem";
function makeScrollingFocusable() {
  for (const wide of document.querySelectorAll("table.table, .equation")) {
    const texts = [...wide.querySelectorAll("td")].filter((cell) => cell.textContent.length > LONG_TEXT);
    for (const cell of texts) cell.style.minWidth = "";
    const scrolls = wide.scrollWidth > wide.clientWidth;
    for (const cell of texts) cell.style.minWidth = scrolls ? TEXT_WIDTH : "";
    if (scrolls) wide.tabIndex = 0;
    else wide.removeAttribute("tabindex");
  }
}
addEventListener("load", makeScrollingFocusable);
addEventListener("resize", makeScrollingFocusable);
