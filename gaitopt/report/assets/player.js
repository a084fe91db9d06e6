"use strict";
// Every position is computed beforehand; a player only puts things where they are in a frame.
function startPlayer(section) {
  const player = section.querySelector(".player");
  if (!player) return;
  const film = JSON.parse(player.querySelector("script.film").textContent);
  const find = (name) => player.querySelector(name);
  const [stage, button, slider, stamp] = [".stage", ".play", ".time", ".stamp"].map(find);
  const all = (name) => [...player.querySelectorAll(name)];
  const [links, rims, joints, marks, tokens, outcomes] = [".link", ".rim", ".joint", ".mark", ".token", ".token.impact"].map(all);
  const impulses = all(".impulse").filter((part) => part.closest(".stage"));
  const [cones, forces, feet] = [".stage .cone", ".stage .force", ".stage .foot"].map(all);
  const charts = [...section.querySelectorAll("figure.chart")].map((figure) => ({
    dots: [...figure.querySelectorAll(".dot")],
    cursor: figure.querySelector(".cursor"),
    outputs: [...figure.querySelectorAll("output")],
  }));
  const perStep = film.frames.length, last = film.steps * perStep - 1;
  let current = 0, playing = false, before = 0;

  function put(element, attributes) {
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  }

  function show(position) {
    current = Math.max(0, Math.min(last, position));
    const number = Math.round(current), step = Math.floor(number / perStep), frame = film.frames[number % perStep];
    const dx = step * film.shift[0], dy = step * film.shift[1];
    frame.links.forEach(([x1, y1, x2, y2], i) => put(links[i], { x1: x1 + dx, y1: y1 + dy, x2: x2 + dx, y2: y2 + dy }));
    frame.rims.forEach(([x, y, turn], i) => put(rims[i], { transform: `translate(${x + dx} ${y + dy}) rotate(${turn})` }));
    frame.joints.forEach(([x, y], i) => put(joints[i], { cx: x + dx, cy: y + dy }));
    frame.foot.forEach(([x, y], i) => {
      const seen = frame.modes[i] === "free" ? "hidden" : "visible";
      for (const parts of [cones, forces, feet]) put(parts[i], { transform: `translate(${x + dx} ${y + dy})`, visibility: seen });
      put(forces[i], { x2: frame.force[i][0], y2: frame.force[i][1] });
      put(feet[i], { class: `foot ${frame.modes[i]}` });
    });
    stage.classList.toggle("swapped", step % 2 === 1);
    for (const mark of marks) {
      const { step: own, phase } = mark.dataset;
      mark.classList.toggle("made", own < step || (own == step && phase <= frame.phase));
    }
    for (const impulse of impulses) {
      const { begin, end } = impulse.dataset, shown = number / film.rate;
      impulse.classList.toggle("made", begin <= shown && shown < end);
    }
    tokens.forEach((token) => token.classList.toggle("now", token.dataset.phase == frame.phase));
    outcomes.forEach((token) => token.classList.toggle("now", step > 0 && (number % perStep) < 0.3 * film.rate));
    frame.charts.forEach((chart, i) => chart.forEach(([x, y, text], j) => {
      put(charts[i].dots[j], { cx: x, cy: y });
      charts[i].outputs[j].value = text;
      if (charts[i].cursor) put(charts[i].cursor, { x1: x, x2: x });
    }));
    const time = (frame.time + step * film.period).toFixed(3);
    stamp.value = `step ${step + 1}/${film.steps}  t = ${time} s  slowed ${frame.pace}\u00d7`;
    slider.value = number;
    slider.setAttribute("aria-valuetext", `${time} seconds, ${frame.mode.replace("_", " ")}`);
  }

  function tick(now) {
    if (!playing) return;
    show(current + (now - before) / 1000 * film.rate);
    before = now;
    if (current >= last) play(false);
    else requestAnimationFrame(tick);
  }

  function play(wanted) {
    if (wanted && current >= last) show(0);
    playing = wanted;
    button.textContent = playing ? "\u275a\u275a" : "\u25b6";
    button.setAttribute("aria-label", playing ? "Pause" : "Play");
    before = performance.now();
    if (playing) requestAnimationFrame(tick);
  }

  button.addEventListener("click", () => play(!playing));
  slider.addEventListener("input", () => { play(false); show(Number(slider.value)); });
  player.addEventListener("keydown", (event) => {
    if (event.key === " " && event.target !== button) play(!playing);
    else if (["ArrowLeft", "ArrowRight"].includes(event.key) && event.target !== slider) {
      play(false);
      show(Math.round(current) + (event.key === "ArrowRight" ? 1 : -1));
    } else return;
    event.preventDefault();
  });
  show(0);
}
document.querySelectorAll("section.gait").forEach(startPlayer);
