// What a robot has told of its camera and its place, in words.
const LENSES = { none: "no distortion", plumb_bob: "a plumb-bob lens", equidistant: "a fisheye lens" };

export function cameraWords(camera) {
  if (!camera) return "It has told none yet.";
  const { width, height, fx, fy } = camera;
  const degrees = (px, f) => Math.round((360 / Math.PI) * Math.atan(px / 2 / f));
  return `${width} x ${height} pixels, some ${degrees(width, fx)} x ${degrees(height, fy)} degrees, ${LENSES[camera.distortion.model]}.`;
}

export function placeWords(pose) {
  const at = pose?.position_m;
  return at ? `x ${at[0].toFixed(2)} m, y ${at[1].toFixed(2)} m, z ${at[2].toFixed(2)} m` : "not told yet";
}
