"use strict";
// A click on a point of a branch, or Enter on it, shows the gait of this point and plays it.
const branchPoints = [...document.querySelectorAll(".branch-point")];
const focusable = branchPoints.filter((point) => point.hasAttribute("tabindex"));
function showGait(name) {
  for (const point of branchPoints) point.classList.toggle("chosen", point.dataset.gait === name);
  for (const gait of document.querySelectorAll(".branch-gait")) gait.hidden = gait.id !== name;
  const button = document.querySelector(`#${name} .play`);
  if (button) button.click();
}
for (const point of branchPoints) point.addEventListener("click", () => showGait(point.dataset.gait));
focusable.forEach((point, number) => {
  point.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (event.key === "Enter") showGait(point.dataset.gait);
    else if (step && focusable[number + step]) focusable[number + step].focus();
    else return;
    event.preventDefault();
  });
});
