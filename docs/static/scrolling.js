// A table or an equation that is wider than the page scrolls; the keyboard must reach it, and its cells of text need not
// be as narrow as their longest word: short texts are in one line, and long ones on a phone are as wide as its screen.
const LONG_TEXT = 20, LONGEST_TEXT = 120, TEXT_WIDTH = "10rem", LONGEST_TEXT_WIDTH = "19rem";
const phone = matchMedia("(max-width: 600px)");
function makeScrollingFocusable() {
  for (const wide of document.querySelectorAll("table.table, .equation")) {
    const cells = [...wide.querySelectorAll("td")];
    for (const cell of cells) cell.style.minWidth = cell.style.whiteSpace = "";
    const scrolls = wide.scrollWidth > wide.clientWidth;
    for (const cell of scrolls ? cells : []) {
      const length = cell.textContent.length;
      if (length <= LONG_TEXT) cell.style.whiteSpace = "nowrap";
      else cell.style.minWidth = phone.matches && length > LONGEST_TEXT ? LONGEST_TEXT_WIDTH : TEXT_WIDTH;
    }
    if (scrolls) wide.tabIndex = 0;
    else wide.removeAttribute("tabindex");
  }
}
addEventListener("load", makeScrollingFocusable);
addEventListener("resize", makeScrollingFocusable);
