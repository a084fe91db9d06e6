"use strict";
// A click on a point of a branch, or Enter on it, shows the gait of this point and plays it.
const branchPoints = [...document.querySelectorAll(".branch-point")];
function showGait(point) {
  for (const other of branchPoints) other.classList.toggle("chosen", other === point);
  for (const gait of document.querySelectorAll(".branch-gait")) gait.hidden = gait.id !== point.dataset.gait;
  const button = document.querySelector(`#${point.dataset.gait} .play`);
  if (button) button.click();
}
branchPoints.forEach((point, number) => {
  point.addEventListener("click", () => showGait(point));
  point.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (event.key === "Enter") showGait(point);
    else if (step && branchPoints[number + step]) branchPoints[number + step].focus();
    else return;
    event.preventDefault();
  });
});
