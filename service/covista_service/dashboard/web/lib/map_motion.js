// Robots between two frames: news comes twice a second, and what moves is to move. Also where each of them was.
const TRACK_S = 60;
const TRACK_STEP_S = 0.9;

const between = (a, b, share) => a + share * (b - a);

export class Motion {
  constructor() {
    this.robots = new Map();
    this.begun = 0;
    this.lasts = 1;
  }

  // A new frame is there. `moving` false puts everybody in their place at once.
  take(robots, nowMs, moving = true) {
    const shown = new Map([...this.robots].map(([id, each]) => [id, this._at(each, nowMs)]));
    this.lasts = moving ? Math.min(1200, Math.max(100, nowMs - this.begun)) : 1;
    this.begun = nowMs;
    const next = new Map();
    for (const robot of robots) {
      const known = this.robots.get(robot.id);
      const from = shown.get(robot.id);
      const track = known ? known.track : [];
      if (robot.at && (!track.length || nowMs - track.at(-1)[2] > 1000 * TRACK_STEP_S)) {
        track.push([robot.at[0], robot.at[1], nowMs]);
        while (track.length && nowMs - track[0][2] > 1000 * TRACK_S) track.shift();
      }
      next.set(robot.id, { robot, from: from?.at ?? robot.at, fromView: from?.view ?? robot.view, track });
    }
    this.robots = next;
  }

  // What comes next did not come of what is shown: in the past one leaps.
  forget() {
    this.robots = new Map();
  }

  // Where everybody is to be drawn: [{ robot, at, view, track }].
  now(nowMs) {
    return [...this.robots.values()].map((each) => ({ ...this._at(each, nowMs), robot: each.robot, track: each.track }));
  }

  rests(nowMs) {
    return nowMs - this.begun >= this.lasts;
  }

  _at({ robot, from, fromView }, nowMs) {
    const share = Math.min(1, (nowMs - this.begun) / this.lasts);
    if (!robot.at || !from || share >= 1) return { at: robot.at, view: robot.view };
    return {
      at: [between(from[0], robot.at[0], share), between(from[1], robot.at[1], share)],
      view: robot.view && fromView ? robot.view.map((value, k) => between(fromView[k], value, share)) : robot.view,
    };
  }
}
