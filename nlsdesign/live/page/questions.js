// What is asked of the session: one at a time, in order. Moves of one drag are sent as they come, since the
// session takes the newest that has arrived when it is free; sent after the answer they would wait for its way back.

export class Questions {
  // send(message) tells whether it went; told(busy) whether an answer is awaited.
  constructor(send, told) {
    this.send = send;
    this.told = told;
    // Above all numbers of an earlier load of this page, to which answers may still be on their way.
    this.number = Date.now();
    this.waiting = [];
    this.open = null;
    this.dragged = null;
    this.times = new Map();
  }

  ask(message, begin = performance.now()) {
    this.number += 1;
    const numbered = { ...message, number: this.number };
    this.times.set(this.number, begin);
    const last = this.waiting.at(-1);
    if (last && message.drag && last.drag === message.drag) this.waiting[this.waiting.length - 1] = numbered;
    else this.waiting.push(numbered);
    this.next();
    return this.number;
  }

  // The answer to a question has come, or its refusal.
  answered(number) {
    if (this.open !== null && number >= this.open) this.open = null;
    this.next();
  }

  next() {
    while (this.waiting.length > 0 && this.ready(this.waiting[0]) && this.send(this.waiting[0])) {
      const { number, drag } = this.waiting.shift();
      this.open = number;
      this.dragged = drag ?? null;
    }
    this.told(this.busy);
  }

  ready(message) {
    return this.open === null || (this.dragged !== null && message.drag === this.dragged);
  }

  // The page is left: what waits must not be lost.
  flush() {
    for (const message of this.waiting.splice(0)) this.send(message);
  }

  // After the connection broke off nothing is on its way any more.
  again() {
    this.open = null;
    this.next();
  }

  get busy() {
    return this.open !== null || this.waiting.length > 0;
  }

  // What was asked up to a number is on the screen now: one measure for each movement of a hand.
  drawn(number, kind) {
    const end = performance.now();
    for (const [asked, begin] of this.times) {
      if (asked > number) continue;
      this.times.delete(asked);
      if (kind) performance.measure(kind, { start: begin, end });
    }
    if (performance.getEntriesByName(kind).length > 5000) performance.clearMeasures();
  }
}
