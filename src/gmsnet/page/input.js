// Keys, mouse, wheel and fingers on the picture.

const pressed = (view, event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const moves = { ArrowLeft: [40, 0], ArrowRight: [-40, 0], ArrowUp: [0, 40], ArrowDown: [0, -40] };
  const { camera } = view;
  if (moves[event.key]) {
    const [dx, dy] = moves[event.key];
    if (view.scene.dimension === 3 && !event.shiftKey) camera.turn(dx / 2, dy / 2);
    else camera.move(dx, dy);
  } else if (event.key === "+" || event.key === "=") camera.zoomBy(1.25, 0, 0);
  else if (event.key === "-" || event.key === "_") camera.zoomBy(0.8, 0, 0);
  else if (event.key === "0" || event.key === "Home") view.showWhole();
  else if (event.key === "n" || event.key === "p") view.next(event.key === "n" ? 1 : -1);
  else if (event.key === "Escape") view.choose(-1);
  else if (event.key === " " && view.both) {
    find("mix").value = view.look.mixing > 0.5 ? 0 : 100;
    view.mixTo(find("mix").value / 100);
  } else return;
  event.preventDefault();
  view.paint();
};

const wirePointer = (view) => {
  const { canvas, camera } = view;
  const held = new Map();
  let travelled = 0;
  const place = (event) => [event.offsetX, event.offsetY];
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, place(event));
    travelled = held.size > 1 ? Infinity : 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    const from = held.get(event.pointerId);
    if (!from) return;
    const to = place(event);
    const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    travelled += Math.hypot(dx, dy);
    if (held.size === 2) {
      const other = [...held.entries()].find(([id]) => id !== event.pointerId)[1];
      const apart = ([x, y]) => Math.hypot(x - other[0], y - other[1]);
      const middle = [0, 1].map((k) => 0.5 * (to[k] + other[k]));
      camera.move(dx / 2, dy / 2);
      camera.zoomBy(apart(to) / Math.max(apart(from), 1), middle[0] - 0.5 * camera.width, middle[1] - 0.5 * camera.height);
    } else if (view.scene.dimension === 3 && !event.shiftKey && event.buttons === 1) camera.turn(dx, dy);
    else camera.move(dx, dy);
    held.set(event.pointerId, to);
    view.paint();
  });
  for (const name of ["pointerup", "pointercancel"])
    canvas.addEventListener(name, (event) => {
      const began = held.delete(event.pointerId);
      if (began && name === "pointerup" && travelled < 4 && event.button === 0) view.pick(...place(event));
    });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener(
    "wheel",
    (event) => {
      if (document.activeElement !== canvas && !event.ctrlKey) return; // the page scrolls until one has chosen the picture
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 16 : 1;
      camera.zoomBy(Math.exp((-event.deltaY * lines) / 400), event.offsetX - 0.5 * camera.width, event.offsetY - 0.5 * camera.height);
      view.paint();
    },
    { passive: false },
  );
};
