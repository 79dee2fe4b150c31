// SPDX-License-Identifier: MIT
// The panel that edits objects of the scene, for holders of the editing link. Independent of the socket: ask()
// sends a request, take() receives its answer.

const SEARCH_PAUSE_MS = 250;
const KEYS = { z: "undo", "Shift+z": "redo", y: "redo" }; // together with Control, or Command on a Mac
const BRIGHTEST = 1; // brightest component that a colour input can show

const $ = (id) => document.getElementById(id);
const encode = (linear) => (linear <= 0.0031308 ? linear * 12.92 : 1.055 * linear ** (1 / 2.4) - 0.055);
const decode = (shown) => (shown <= 0.04045 ? shown / 12.92 : ((shown + 0.055) / 1.055) ** 2.4);
const same = (value) => value; // for scenes whose colours are display values
const hex = (values, shown) => `#${values.slice(0, 3).map((value) => Math.round(shown(Math.min(1, value)) * 255).toString(16).padStart(2, "0")).join("")}`;
const colour = (text, kept) => [1, 3, 5].map((at) => kept(parseInt(text.slice(at, at + 2), 16) / 255));
const round = (value) => Number(value.toPrecision(5));

export class Editing {
  constructor(ask) {
    this.ask = ask;
    this.waiting = []; // requests; the first one is in flight, as the gateway takes one at a time
    this.revision = -1;
    this.display = false; // colours are display values, else linear
    $("edit-kind").addEventListener("change", () => this.list());
    $("edit-match").addEventListener("input", () => {
      clearTimeout(this.searching);
      this.searching = setTimeout(() => this.list(), SEARCH_PAUSE_MS);
    });
    $("edit-object").addEventListener("change", () => this.read());
    for (const name of ["undo", "redo"]) $(`edit-${name}`).addEventListener("click", () => this.turn(name));
    document.addEventListener("keydown", (event) => {
      const name = KEYS[(event.shiftKey ? "Shift+" : "") + event.key.toLowerCase()];
      if (!name || !(event.ctrlKey || event.metaKey) || event.altKey || $("editing").hidden) return;
      if (event.target.matches("input[type=text], input[type=number]")) return; // the field undoes its own text
      event.preventDefault();
      this.turn(name);
    });
  }

  // After a new connection, old requests get no answers and old changes cannot be undone.
  begin(mayEdit) {
    $("editing").hidden = $("edit-keys").hidden = !mayEdit;
    this.waiting = [];
    this.showTurns({ undos: 0, redos: 0 });
  }

  // Disabled buttons show that there is nothing to undo or redo; keys are checked here.
  turn(name) {
    if (!$(`edit-${name}`).disabled) this.request({ [name]: true });
  }

  showTurns({ undos, redos }) {
    $("edit-undo").disabled = undos === 0;
    $("edit-redo").disabled = redos === 0;
  }

  // Queues a request: only the newest waiting query counts, but every change.
  request(message) {
    const name = Object.keys(message)[0];
    if (name === "list" || name === "read") this.waiting = this.waiting.filter((one, i) => i === 0 || !(name in one));
    this.waiting.push(message);
    if (this.waiting.length === 1) this.ask(message);
  }

  say(text) {
    $("edit-state").textContent = text;
  }

  list() {
    if ($("editing").hidden) return;
    this.request({ list: { kind: $("edit-kind").value, match: $("edit-match").value.slice(0, 32) } });
  }

  read() {
    if ($("edit-object").value) this.request({ read: { kind: $("edit-kind").value, id: Number($("edit-object").value) } });
    else $("edit-fields").replaceChildren();
  }

  // Reloads the object, which another client may have changed.
  seen(revision) {
    if ($("editing").hidden || revision === this.revision) return;
    this.revision = revision;
    this.read();
  }

  take(message) {
    const asked = this.waiting.shift();
    if (this.waiting.length > 0) this.ask(this.waiting[0]);
    if (message.refused) {
      this.say(message.refused.text);
      if (asked.read) this.list(); // the object was removed
      else if (!asked.list) this.read(); // shows its current state
    } else if (message.objects) {
      this.takeObjects(message.objects);
    } else if (message.object) {
      this.takeObject(message.object);
    } else {
      this.showTurns(message.edited);
      this.say("");
      this.read();
    }
  }

  takeObjects({ kind, list, more }) {
    if (kind !== $("edit-kind").value) return;
    const chosen = $("edit-object").value;
    $("edit-object").replaceChildren(...list.map(([id, name]) => new Option(name || `${kind} ${id}`, id, false, String(id) === chosen)));
    this.say(more > 0 ? `${more} more: name what you look for` : list.length === 0 ? "There is none" : "");
    this.read();
  }

  takeObject(object) {
    if (object.kind !== $("edit-kind").value || String(object.id) !== $("edit-object").value) return;
    this.revision = Math.max(this.revision, object.revision);
    this.display = object.display_values;
    const focused = document.activeElement && document.activeElement.id;
    $("edit-fields").replaceChildren(...object.fields.filter((field) => field.values.length <= 4).flatMap((field) => this.row(object, field)));
    if (focused && focused.startsWith("field-") && $(focused)) $(focused).focus();
  }

  row(object, field) {
    const label = document.createElement("label");
    label.textContent = field.name.replaceAll("_", " ") + (field.unit ? `, ${field.unit}` : "");
    label.title = field.doc;
    const inputs = this.inputs(field);
    const change = () => {
      const values = this.values(field, inputs);
      if (values.every((value) => Number.isFinite(value))) this.request({ edit: { kind: object.kind, id: object.id, field: field.name, values } });
    };
    inputs.forEach((input, i) => {
      input.id = `field-${field.name}-${i}`;
      if (i > 0) input.setAttribute("aria-label", `${field.name} ${"xyzw"[i]}`);
      input.addEventListener("change", change);
    });
    label.htmlFor = inputs[0].id;
    const values = document.createElement("div");
    values.className = "values";
    values.replaceChildren(...inputs);
    return [label, values];
  }

  inputs(field) {
    if (field.form === "word") {
      const select = document.createElement("select");
      select.replaceChildren(...field.words.map((word, i) => new Option(word, i, false, i === field.values[0])));
      return [select];
    }
    const input = (type, value) => Object.assign(document.createElement("input"), { type, value });
    if (field.form === "flag") return [Object.assign(input("checkbox", ""), { checked: field.values[0] > 0 })];
    if (this.isMenu(field)) return [input("color", hex(field.values, this.display ? same : encode))];
    return field.values.map((value) => Object.assign(input("number", round(value)), { step: "any", min: field.min, max: field.max }));
  }

  isMenu(field) {
    return field.form === "colour" && field.values.slice(0, 3).every((value) => value <= BRIGHTEST);
  }

  values(field, inputs) {
    if (field.form === "flag") return [inputs[0].checked ? 1 : 0];
    // Alpha stays
    if (field.form === "colour" && inputs.length === 1) return colour(inputs[0].value, this.display ? same : decode);
    return inputs.map((input) => (input.value === "" ? NaN : Number(input.value)));
  }
}
