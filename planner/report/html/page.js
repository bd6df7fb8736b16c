"use strict";
(() => {
  const config = JSON.parse(document.getElementById("config").textContent);
  const ROWS_AT_ONCE = 250;
  const NARROW_PX = 560; // legends beside each other need more
  const SPAN = "span_time_min"; // of each picture over time, what of it is shown

  // Thousands of rows are made when their table is opened, some at a time.
  function fillLong(details, table, atOnce = ROWS_AT_ONCE) {
    if (details.querySelector("thead tr")) return;
    const head = document.createElement("tr");
    for (const text of table.heads) {
      const cell = document.createElement("th");
      cell.scope = "col";
      cell.textContent = text;
      head.append(cell);
    }
    details.querySelector("thead").append(head);
    const body = details.querySelector("tbody");
    let next = 0;
    const some = () => {
      const rows = document.createDocumentFragment();
      for (const end = Math.min(next + atOnce, table.text.length); next < end; next += 1) {
        const row = document.createElement("tr");
        table.text[next].forEach((text, column) => {
          const cell = document.createElement("td");
          const value = table.value[next][column];
          if (typeof value === "number") {
            const data = document.createElement("data");
            data.value = String(value);
            data.textContent = text;
            cell.className = "number";
            cell.append(data);
          } else {
            cell.textContent = text;
          }
          row.append(cell);
        });
        rows.append(row);
      }
      body.append(rows);
      if (next < table.text.length) setTimeout(some);
      else details.dataset.filled = "true";
    };
    some();
  }

  // A picture as wide as there is room; a map keeps its metres as long in both directions.
  async function embed(canvas, name, spec) {
    const room = canvas.clientWidth;
    if (name === "map") {
      const inside = Math.min(room - 62, 1.2 * spec.width);
      spec.height = Math.round(inside * spec.height / spec.width);
      spec.width = Math.round(inside);
    } else {
      spec.width = room;
      spec.autosize = { type: "fit-x", contains: "padding" };
    }
    const stacked = { ...config.legend, columns: 2, layout: { bottom: { anchor: "start", direction: "vertical" } } };
    const done = await vegaEmbed(canvas, spec, {
      ast: true, renderer: "svg", actions: false,
      config: room < NARROW_PX ? { ...config, legend: stacked } : config,
    });
    const svg = canvas.querySelector("svg");
    svg.setAttribute("role", "img");
    svg.setAttribute("aria-label", spec.description);
    svg.removeAttribute("aria-roledescription");
    for (const part of svg.querySelectorAll("[aria-label], [role], [aria-roledescription]")) {
      for (const attribute of ["aria-label", "role", "aria-roledescription"]) part.removeAttribute(attribute);
      part.setAttribute("aria-hidden", "true");
    }
    return done.view;
  }

  // Draws at once, as a page that is printed or photographed unseen gets no resize, and when its room changes.
  function drawWhereThereIsRoom(element, draw) {
    let width = 0;
    let waiting;
    const look = () => {
      if (!element.clientWidth || element.clientWidth === width) return;
      width = element.clientWidth;
      draw();
    };
    new ResizeObserver(() => {
      clearTimeout(waiting);
      waiting = setTimeout(look, width ? 150 : 0);
    }).observe(element);
    look();
  }

  // Pictures with a slider: what is over time has a cursor, what is on a map moves.
  class Moving {
    constructor(element, payload) {
      this.element = element;
      this.payload = payload;
      this.views = {};
      this.tables = {};
      for (const [name, table] of Object.entries(this.payload.tables || {})) {
        this.tables[name] = table.rows.map(
          (row) => Object.fromEntries(table.columns.map((column, index) => [column, row[index]])));
      }
    }

    start(end) {
      this.end = end;
      this.slider = this.element.querySelector("input[type=range]");
      this.output = this.element.querySelector("output");
      this.slider.addEventListener("input", () => this.look(this.end * this.slider.value / this.slider.max));
      for (const button of this.element.querySelectorAll("[data-zoom]")) {
        button.addEventListener("click", () => this.zoom(Number(button.dataset.zoom)));
      }
      for (const button of this.element.querySelectorAll("[data-span]")) {
        button.addEventListener("click", () => this.zoomTime(Number(button.dataset.span)));
      }
      drawWhereThereIsRoom(this.element.querySelector(".charts"), () => this.draw());
    }

    async draw() {
      for (const canvas of this.element.querySelectorAll("[data-chart]")) {
        await this.embed(canvas, canvas.dataset.chart);
      }
      this.element.dataset.drawn = "true";
    }

    async embed(canvas, name) {
      const spec = structuredClone(this.payload.charts[name]);
      for (const table of ["cursor", "vehicles", "focus_time", "focus_place"]) spec.datasets[table] = [];
      Object.assign(spec.datasets, this.tables);
      if (matchMedia("(pointer: coarse)").matches) {
        for (const layer of spec.layer) for (const param of layer.params || []) param.select.translate = false;
      }
      if (this.views[name]) this.views[name].finalize();
      this.views[name] = await embed(canvas, name, spec);
      const svg = canvas.querySelector("svg");
      if (name === "map") this.whole = ["view_east_m", "view_north_m"].map((key, axis) =>
        this.views.map.scale(axis ? "y" : "x").domain());
      else {
        const view = this.views[name];
        view.addSignalListener(SPAN, (_, domain) => this.span(domain, name));
        if (this.spanned) view.signal(SPAN, this.spanned).runAsync();
        canvas.addEventListener("pointermove", (event) => {
          const time = this.views[name].scale("x").invert(
            (event.clientX - svg.getBoundingClientRect().left) * (svg.viewBox.baseVal.width || canvas.clientWidth)
              / svg.getBoundingClientRect().width - this.views[name].origin()[0]);
          if (time >= 0 && time <= this.end) this.seek(time);
        });
      }
    }

    // All pictures over time show the same part of it.
    span(domain, from) {
      const same = (one, other) => one === other || (one && other && one.every((end, index) => end === other[index]));
      if (same(domain, this.spanned)) return;
      this.spanned = domain;
      for (const [name, view] of Object.entries(this.views)) {
        if (name !== from && name !== "map") view.signal(SPAN, domain).runAsync();
      }
    }

    // Zoom about the cursor, never beyond the whole.
    zoomTime(factor) {
      const [low, high] = this.spanned || [0, this.end];
      const half = Math.min(factor * (high - low), this.end) / 2;
      const at = Math.min(Math.max(this.end * this.slider.value / this.slider.max, half), this.end - half);
      this.span(factor ? [at - half, at + half] : [0, this.end], "");
    }

    // Put the slider on a time as well.
    seek(time) {
      this.slider.value = String(Math.round(time / this.end * this.slider.max));
      this.look(time);
    }

    // The row of a table that is not later than a time.
    at(table, time, key = "time_min") {
      let low = 0;
      for (let high = table.length - 1; low < high;) {
        const middle = Math.ceil((low + high) / 2);
        if (table[middle][key] <= time) low = middle;
        else high = middle - 1;
      }
      return table[low];
    }

    zoom(factor) {
      const view = this.views.map;
      ["x", "y"].forEach((axis, index) => {
        const [low, high] = view.scale(axis).domain();
        const middle = (low + high) / 2;
        const domain = factor ? [low, high].map((end) => middle + factor * (end - middle)) : this.whole[index];
        view.signal(axis === "x" ? "view_east_m" : "view_north_m", domain);
      });
      view.runAsync();
    }
  }

  class Mission extends Moving {
    constructor(element) {
      super(element, JSON.parse(document.getElementById(`payload-${element.dataset.mission}`).textContent));
      this.focused = null;
      for (const details of element.querySelectorAll("[data-long]")) {
        details.addEventListener("toggle", () => {
          if (details.open) fillLong(details, this.payload.long[details.dataset.long]);
        });
      }
      // On paper nothing can be opened: tables are, and closed again.
      let closed = [];
      addEventListener("beforeprint", () => {
        if (element.localName === "details" && !element.open) return;
        closed = [...element.querySelectorAll("details.printed:not([open])")];
        for (const details of closed) {
          if (details.dataset.long) fillLong(details, this.payload.long[details.dataset.long], Infinity);
          details.open = true;
        }
      });
      addEventListener("afterprint", () => {
        for (const details of closed) details.open = false;
      });
      if (!this.payload.charts) return;
      for (const button of element.querySelectorAll("button.show")) {
        button.addEventListener("click", () => this.show(button));
      }
      this.start(this.tables.flight[this.tables.flight.length - 1].time_min);
    }

    async draw() {
      await super.draw();
      if (this.focused) this.focus(this.focused);
    }

    look(time) {
      const row = this.at(this.tables.flight, time);
      for (const view of Object.values(this.views)) view.data("cursor", [row]).runAsync();
      const texts = [
        `${row.time_min.toFixed(2)} min`, `item ${row.item}, ${row.state}`,
        `${(row.altitude_amsl_m - (this.payload.home_amsl_m ?? 0)).toFixed(0)} m above home`];
      if (this.payload.home_amsl_m !== null) texts[2] += `, ${row.altitude_amsl_m.toFixed(0)} m AMSL`;
      if (typeof row.ground_amsl_m === "number") texts.push(`${(row.altitude_amsl_m - row.ground_amsl_m).toFixed(0)} m above the ground`);
      texts.push(`${row.speed_m_s.toFixed(1)} m/s`);
      if (typeof row.power_w === "number") texts.push(`${row.power_w.toFixed(0)} W`);
      if (typeof row.used_wh === "number") texts.push(`${row.used_wh.toFixed(2)} Wh used`);
      if (this.tables.returns) {
        const home = this.at(this.tables.returns, time);
        texts.push(`${home.needed_wh.toFixed(2)} Wh used once home`);
      }
      this.output.textContent = texts.join(" · ");
      this.slider.setAttribute("aria-valuetext", texts.slice(0, 2).join(", "));
    }

    show(button) {
      const finding = this.payload.focus[Number(button.dataset.finding)];
      const again = this.focused === finding;
      for (const one of this.element.querySelectorAll("button.show")) {
        one.setAttribute("aria-pressed", String(one === button && !again));
        one.closest(".finding").classList.toggle("shown", one === button && !again);
      }
      this.focus(again ? null : finding);
      if (!again) this.element.querySelector(".chart.map").scrollIntoView({ block: "center" });
    }

    focus(finding) {
      this.focused = finding;
      let places = [];
      if (finding && finding.stretch) places = finding.stretch;
      else if (finding) {
        const path = this.tables.path;
        places = path.filter((row, index) => row.item === finding.item
          || (index + 1 < path.length && path[index + 1].item === finding.item));
      }
      places = places.map((row, order) => ({ east_m: row.east_m, north_m: row.north_m, part: row.part || 0, order }));
      const times = finding && "start_min" in finding ? [finding] : [];
      for (const [name, view] of Object.entries(this.views)) {
        view.data(name === "map" ? "focus_place" : "focus_time", name === "map" ? places : times).runAsync();
      }
    }
  }

  // 3661 s as 1:01:01, 61 s as 1:01.
  function clock(time, isTimeOfDay = false) {
    const whole = Math.round(time);
    const [hours, minutes, seconds] = [whole / 3600, whole / 60 % 60, whole % 60].map(Math.floor);
    const two = (number) => String(number).padStart(2, "0");
    if (isTimeOfDay) return `${two(hours % 24)}:${two(minutes)}:${two(seconds)}`;
    return hours ? `${hours}:${two(minutes)}:${two(seconds)}` : `${minutes}:${two(seconds)}`;
  }

  // Columns as rows: texts with their counts, and numbers by the digits after their point and their differences.
  function unpacked(columns) {
    const rows = [];
    for (const [name, [first, ...rest]] of Object.entries(columns)) {
      let values;
      if (Array.isArray(first)) values = [first, ...rest].flatMap(([text, count]) => Array(count).fill(text));
      else {
        let sum = 0;
        values = rest.map((more) => { sum += more; return sum / 10 ** first; });
      }
      values.forEach((value, index) => { rows[index] = { ...rows[index], [name]: value }; });
    }
    return rows;
  }

  class Fleet extends Moving {
    constructor(element) {
      const payload = JSON.parse(document.getElementById("payload-fleet").textContent);
      super(element, { ...payload, tables: {} });
      for (const [name, columns] of Object.entries(payload.tables || {})) this.tables[name] = unpacked(columns);
      if (!this.payload.charts) return;
      this.tracks = new Map(); // of each vehicle those of its sorties, in the order of time
      for (const row of this.tables.tracks) {
        if (!this.tracks.has(row.vehicle)) this.tracks.set(row.vehicle, new Map());
        const own = this.tracks.get(row.vehicle);
        if (!own.has(row.sortie)) own.set(row.sortie, []);
        own.get(row.sortie).push(row);
      }
      this.events = new Map(); // what each sortie is about, in the order of time
      for (const row of this.tables.items) {
        if (!this.events.has(row.sortie)) this.events.set(row.sortie, []);
        this.events.get(row.sortie).push(row);
      }
      this.rows = new Map([...element.querySelectorAll(".now tbody tr")].map((row) => [row.dataset.vehicle, row]));
      this.play = element.querySelector("[data-play]");
      this.speed = element.querySelector("[data-speed]");
      // The slowest that shows the whole in a minute and a half.
      const speeds = [...this.speed.options].map((option) => option.value);
      this.speed.value = speeds.find((speed) => this.payload.end_s / speed <= 90) || speeds[speeds.length - 1];
      this.play.addEventListener("click", () => this.toggle());
      for (const button of element.querySelectorAll("[data-mark]")) {
        button.addEventListener("click", () => this.step(Number(button.dataset.mark)));
      }
      for (const button of element.querySelectorAll("button.show")) {
        button.addEventListener("click", () => {
          this.seek(Number(button.dataset.at) / 60);
          element.querySelector(".chart.map").scrollIntoView({ block: "center" });
        });
      }
      this.start(this.payload.end_s / 60);
      this.slider.addEventListener("keydown", (event) => {
        if (event.key !== " ") return;
        event.preventDefault();
        this.toggle();
      });
      this.look(0);
    }

    async draw() {
      await super.draw();
      if (this.views.map) this.views.map.addSignalListener("view_east_m", () => this.look(this.time));
      this.look(this.time);
    }

    // Names that have room on the map, of vehicles beside them and of pads below: the table has them all.
    name(vehicles) {
      const view = this.views.map;
      const [x, y] = ["x", "y"].map((axis) => view.scale(axis));
      const dots = vehicles.map((one) => ({ one, box: [x(one.east_m) - 7, y(one.north_m) - 7, x(one.east_m) + 7, y(one.north_m) + 7] }));
      const taken = [];
      const fits = (box, one) => [...taken, ...dots].every((other) => other.one === one
        || box[0] >= other.box[2] || box[2] <= other.box[0] || box[1] >= other.box[3] || box[3] <= other.box[1]);
      const placed = (one, text, left, top) => {
        const box = [left, top, left + 6.5 * text.length, top + 12];
        if (!fits(box, one)) return "";
        taken.push({ box });
        return text;
      };
      for (const one of vehicles) one.name = placed(one, one.vehicle, x(one.east_m) + 11, y(one.north_m) - 6);
      // new rows: copies would have the marks by which Vega knows the old ones
      const pads = this.tables.pads.map(({ name, east_m, north_m }) => ({ east_m, north_m,
        name: placed(null, name, x(east_m) - 8 - 6.5 * name.length, y(north_m) + 2) }));
      view.data("pads", pads);
    }

    toggle() {
      this.playing = !this.playing;
      this.play.textContent = this.playing ? "Pause" : "Play";
      this.play.setAttribute("aria-pressed", String(this.playing));
      this.output.setAttribute("aria-live", this.playing ? "off" : "polite");
      if (!this.playing) return;
      if (this.time >= this.end) this.seek(0);
      let before = performance.now();
      const frame = async (now) => {
        if (!this.playing) return;
        const time = Math.min(this.time + (now - before) / 60000 * Number(this.speed.value), this.end);
        before = now;
        this.slider.value = String(Math.round(time / this.end * this.slider.max));
        await this.look(time);
        if (time >= this.end) this.toggle();
        else requestAnimationFrame(frame);
      };
      requestAnimationFrame(frame);
    }

    step(by) {
      const times = [...new Set(this.payload.marks.map((mark) => mark.at_s / 60))].sort((a, b) => a - b);
      const next = by > 0 ? times.find((time) => time > this.time + 1e-9)
        : times.reverse().find((time) => time < this.time - 1e-9);
      if (next !== undefined) this.seek(next);
    }

    // Where a vehicle is: flown, last flown, or still before its first sortie.
    where(vehicle, seconds) {
      const own = [...this.tracks.get(vehicle).values()];
      const track = own.filter((rows) => rows[0].time_s <= seconds).pop() || own[0];
      const [first, last] = [track[0], track[track.length - 1]];
      const row = this.at(track, seconds, "time_s");
      const next = track[track.indexOf(row) + 1] || row;
      const gone = Math.min(Math.max((seconds - row.time_s) / (next.time_s - row.time_s || 1), 0), 1);
      const between = (key) => row[key] + gone * (next[key] - row[key]);
      const { item } = this.at(this.events.get(first.sortie), seconds, "time_s");
      const flies = seconds >= first.time_s && seconds < last.time_s;
      return {
        vehicle, sortie: first.sortie,
        east_m: between("east_m"), north_m: between("north_m"), height_m: between("height_m"),
        used_wh: row.used_wh === null ? null : between("used_wh"),
        flies,
        now: typeof item === "string" ? item : flies ? `item ${item}` : seconds < first.time_s ? `starts at ${clock(first.time_s)}`
          : `ended at ${clock(last.time_s)}`,
      };
    }

    look(time) {
      this.time = time;
      const seconds = time * 60;
      const vehicles = [...this.tracks.keys()].map((vehicle) => this.where(vehicle, seconds));
      if (this.views.map) this.name(vehicles);
      const runs = Object.entries(this.views).map(([name, view]) => {
        if (name === "map" && this.tables.seen) view.signal("now_min", time);
        return view.data(name === "map" ? "vehicles" : "cursor", name === "map" ? vehicles : [{ time_min: time }]).runAsync();
      });
      const group = this.at(this.tables.group, time);
      const texts = [clock(seconds)];
      if (this.payload.start) {
        const [, wall] = this.payload.start.match(/T(\d\d:\d\d:\d\d)/);
        const [hours, minutes, rest] = wall.split(":").map(Number);
        texts.push(`time of day ${clock(hours * 3600 + minutes * 60 + rest + seconds, true)}`);
      }
      texts.push(`${vehicles.filter((one) => one.flies).length} in the air`);
      if (this.views.power || this.payload.charts.power) {
        texts.push(`${group.power_w.toFixed(0)} W`, `${group.used_wh.toFixed(1)} Wh used`);
      }
      if (this.tables.goal) {
        texts.push(`${this.at(this.tables.goal, time).percent.toFixed(1)} % ${this.payload.goal}`);
      }
      const near = this.payload.marks.filter((mark) => Math.abs(mark.at_s - seconds) <= 1);
      texts.push(...near.map((mark) => mark.text));
      this.output.textContent = texts.join(" · ");
      this.slider.setAttribute("aria-valuetext", texts[0]);
      for (const one of vehicles) {
        const shown = { sortie: one.sortie, now: one.now, height: `${one.height_m.toFixed(0)} m`,
          used: one.used_wh === null ? "—" : `${one.used_wh.toFixed(1)} Wh` };
        for (const cell of this.rows.get(one.vehicle).querySelectorAll("td")) cell.textContent = shown[cell.dataset.now];
      }
      return Promise.all(runs);
    }
  }

  // Pictures of a section: nothing in them moves.
  for (const element of document.querySelectorAll("[data-pictures]")) {
    const specs = JSON.parse(document.getElementById(`pictures-${element.dataset.pictures}`).textContent);
    drawWhereThereIsRoom(element.querySelector(".charts"), async () => {
      for (const canvas of element.querySelectorAll("[data-picture]")) {
        await embed(canvas, canvas.dataset.picture, structuredClone(specs[canvas.dataset.picture]));
      }
      element.dataset.drawn = "true";
    });
  }

  for (const element of document.querySelectorAll("[data-fleet]")) new Fleet(element);
  for (const element of document.querySelectorAll("[data-mission]")) {
    if (element.localName !== "details") new Mission(element);
    else element.addEventListener("toggle", () => new Mission(element), { once: true });
  }

  // A link to a part opens it.
  const open = () => {
    const target = location.hash && document.getElementById(location.hash.slice(1));
    if (target && target.localName === "details") target.open = true;
  };
  addEventListener("hashchange", open);
  open();

  for (const table of document.querySelectorAll("table.sortable")) {
    const heads = [...table.querySelectorAll("thead th")];
    heads.forEach((head, column) => head.querySelector("button").addEventListener("click", () => {
      const up = head.getAttribute("aria-sort") !== "ascending";
      for (const one of heads) one.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
      const key = (row) => row.children[column].dataset.sort;
      const rows = [...table.tBodies[0].rows].sort((one, other) => {
        const [a, b] = [key(one), key(other)];
        if (!a || !b) return (a ? 0 : 1) - (b ? 0 : 1);
        const order = isNaN(a) || isNaN(b) ? a.localeCompare(b) : a - b;
        return up ? order : -order;
      });
      table.tBodies[0].append(...rows);
    }));
  }
})();
