// What the page says to its session: one change in flight, the newest waits; answers of others come as a stream.

const TOKEN_KEY = "cellplan-token"; // of this tab alone, so that the page can be loaded again
const SILENT_MS = 20000; // without a sign of life after which the session counts as gone

/** The token of the address, which is removed from there at once. */
function takenToken() {
  const { token, ...others } = readAddress();
  if (token) {
    writeAddress(others);
    sessionStorage.setItem(TOKEN_KEY, token);
  }
  return token ?? sessionStorage.getItem(TOKEN_KEY);
}

/** A request that the session refuses, with its reason. */
class RefusedError extends Error {}

/** No answer: the session has ended, or does not reply. */
class GoneError extends Error {}

/** What the network promises; its failures are of another kind than our own. */
function answered(promise) {
  return promise.catch((error) => {
    throw new GoneError(error.message);
  });
}

class Client {
  /** Receivers: `answer`, `event`, `refused` and `gone`, each a function. */
  constructor(token, receivers) {
    this.token = token;
    this.tab = crypto.getRandomValues(new Uint32Array(1))[0]; // tells this page from others of the session
    this.receivers = receivers;
    this.number = 0; // of the last change
    this.answered = 0; // number of the last change that is answered
    this.waiting = null; // the change that is sent next
    this.isSending = false;
    this.isGone = false;
  }

  async post(path, body, signal = null) {
    const headers = { "Content-Type": "application/json", "X-Cellplan-Token": this.token };
    const options = { method: "POST", headers, body: JSON.stringify({ ...body, tab: this.tab }), cache: "no-store", credentials: "omit", signal };
    const reply = await answered(fetch(path, options));
    if (!reply.ok) throw new RefusedError(reasonIn(await reply.text()) || `refused with status ${reply.status}`);
    return reply;
  }

  async record(path, body) {
    return (await this.post(path, body)).json();
  }

  /** Send values by address, or another block; what waits is joined, later values win. */
  change(values, block) {
    this.number += 1;
    this.waiting = { values: { ...this.waiting?.values, ...values }, block: block ?? this.waiting?.block };
    if (!this.isSending) this.send();
  }

  async send() {
    this.isSending = true;
    let show = () => {}; // the answer before, once the next change is on its way
    while (this.waiting && !this.isGone) {
      const { values, block } = this.waiting;
      const number = this.number;
      this.waiting = null;
      await this.guarded(async () => {
        const coming = this.record("/change", { number, block: block ?? null, values });
        show();
        show = () => { this.answered = number; };
        const answer = await coming;
        if (answer.superseded) return;
        show = () => {
          this.answered = number;
          this.receivers.answer(answer);
        };
      });
    }
    this.isSending = false;
    show();
  }

  /** An action of the session, after the changes before it. */
  async act(action, argument) {
    while (this.isSending && !this.isGone) await new Promise((go) => setTimeout(go, 20));
    await this.guarded(async () => {
      const record = await this.record("/do", argument === undefined ? { action } : { action, argument });
      if (record.event) this.receivers.event(record);
      else if (record.values) this.receivers.answer(record);
    });
  }

  /** Run a request; a refusal is shown, and a session that does not answer is gone. */
  async guarded(request) {
    try {
      await request();
    } catch (error) {
      if (error instanceof RefusedError) this.receivers.refused(error.message);
      else if (error instanceof GoneError) this.leave();
      else throw error;
    }
  }

  leave() {
    if (this.isGone) return;
    this.isGone = true;
    this.receivers.gone();
  }

  /** Follow the stream of events until it ends; `opened` is called once none is missed any more. */
  async follow(opened) {
    const silence = new AbortController();
    let timer = setTimeout(() => silence.abort(), SILENT_MS);
    await this.guarded(async () => {
      const { body } = await this.post("/events", {}, silence.signal);
      opened();
      const reader = body.pipeThrough(new TextDecoderStream()).getReader();
      let left = "";
      for (;;) {
        const { done, value } = await answered(reader.read());
        clearTimeout(timer);
        if (done) break;
        timer = setTimeout(() => silence.abort(), SILENT_MS);
        const lines = (left + value).split("\n");
        left = lines.pop();
        for (const line of lines) if (line.trim()) this.receivers.event(JSON.parse(line));
      }
    });
    clearTimeout(timer);
    this.leave();
  }
}

/** The reason that a refusal states. */
function reasonIn(text) {
  try {
    return JSON.parse(text).error ?? text;
  } catch {
    return text.trim();
  }
}
