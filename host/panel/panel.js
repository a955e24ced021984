// SPDX-License-Identifier: Apache-2.0
// The page says that it is there once a second, and that a finger is on a jog button ten times a
// second. Each message repeats the last number that the panel has sent. So what a broken connection
// has delayed is known to be old, and moves nothing.
let finger = null;
const beat = () => Number((document.getElementById("beat") || {}).textContent || 0);
const jogEnd = () => {
  if (finger === null) return;
  clearInterval(finger);
  finger = null;
  emitEvent("panel_jog_end", {});
};
const jogStart = (axis, way) => {
  jogEnd();
  const tell = () => emitEvent("panel_jog", {axis, way, beat: beat()});
  finger = setInterval(tell, 100);
  tell();
};
// On a slow computer the page's own script, which has emitEvent, may come more than a second later.
setInterval(() => typeof emitEvent === "function" && emitEvent("panel_here", {beat: beat()}), 1000);
for (const end of ["pointerup", "pointercancel", "blur", "pagehide"]) addEventListener(end, jogEnd);
document.addEventListener("visibilitychange", () => document.hidden && jogEnd());
document.addEventListener("contextmenu", event => finger !== null && event.preventDefault());
