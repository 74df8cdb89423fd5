// Time: playing, pausing, stepping, and the instant in the address of the page (`#t=1.32`).

const SPEEDS = [0.05, 0.1, 0.25, 0.5, 1, 2, 4];

class Player {
  constructor(onTime) {
    this.onTime = onTime;
    this.t = 0;
    this.speed = 1;
    this.isPlaying = false;
    this.isLooping = false; // whether the begin follows the end
    this.last = null;
  }

  setMotion(motion) {
    this.motion = motion;
    this.t = clamp(this.t, 0, motion.end);
  }

  /** Go to an instant; the motion stands there. */
  goTo(t) {
    this.t = clamp(t, 0, this.motion.end);
    this.onTime();
  }

  play() {
    if (this.motion.end <= 0) return;
    if (this.t >= this.motion.end) this.t = 0;
    this.isPlaying = true;
    this.last = null;
    this.onTime();
    requestAnimationFrame((now) => this.tick(now));
  }

  pause() {
    this.isPlaying = false;
    this.onTime();
  }

  toggle() {
    if (this.isPlaying) this.pause();
    else this.play();
  }

  tick(now) {
    if (!this.isPlaying) return;
    if (this.last !== null) this.t += (this.speed * (now - this.last)) / 1000;
    this.last = now;
    if (this.isLooping) this.t %= this.motion.end;
    if (this.t >= this.motion.end) {
      this.t = this.motion.end;
      this.pause();
      return;
    }
    this.onTime();
    requestAnimationFrame((next) => this.tick(next));
  }

  /** Go to a neighbouring row of the program. */
  step(rows) {
    this.isPlaying = false;
    const row = this.motion.rowBefore(this.t) + rows;
    this.goTo(this.motion.times[clamp(row, 0, this.motion.count - 1)]);
  }

  faster(steps) {
    const place = SPEEDS.indexOf(this.speed);
    this.speed = SPEEDS[clamp(place + steps, 0, SPEEDS.length - 1)];
    this.onTime();
  }
}

/** What the address of the page says: `#t=1.32&view=top&layout=3&still`. */
function readAddress() {
  const found = {};
  for (const piece of location.hash.slice(1).split("&")) {
    const [key, value = ""] = piece.split("=");
    if (key) found[key] = decodeURIComponent(value);
  }
  return found;
}

/** Put the instant into the address, so that it can be copied. */
function writeAddress(values) {
  const text = Object.entries(values).map(([key, value]) => (value === "" ? key : `${key}=${value}`)).join("&");
  history.replaceState(null, "", `#${text}`);
}
