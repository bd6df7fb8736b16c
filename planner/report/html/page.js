"use strict";
(() => {
  const config = JSON.parse(document.getElementById("config").textContent);
  const ROWS_AT_ONCE = 250;
  const NARROW_PX = 560; // legends beside each other need more

  // Thousands of rows are made when their table is opened, some at a time.
  function fillLong(details, table) {
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
      for (const end = Math.min(next + ROWS_AT_ONCE, table.text.length); next < end; next += 1) {
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

  class Mission {
    constructor(element) {
      this.element = element;
      this.payload = JSON.parse(document.getElementById(`payload-${element.dataset.mission}`).textContent);
      this.views = {};
      this.tables = {};
      this.focused = null;
      for (const [name, table] of Object.entries(this.payload.tables || {})) {
        this.tables[name] = table.rows.map(
          (row) => Object.fromEntries(table.columns.map((column, index) => [column, row[index]])));
      }
      for (const details of element.querySelectorAll("[data-long]")) {
        details.addEventListener("toggle", () => {
          if (details.open && !details.querySelector("thead tr")) {
            fillLong(details, this.payload.long[details.dataset.long]);
          }
        });
      }
      if (!this.payload.charts) return;
      this.slider = element.querySelector("input[type=range]");
      this.output = element.querySelector("output");
      this.end = this.tables.flight[this.tables.flight.length - 1].time_min;
      this.slider.addEventListener("input", () => this.look(this.end * this.slider.value / this.slider.max));
      for (const button of element.querySelectorAll("button.show")) {
        button.addEventListener("click", () => this.show(button));
      }
      for (const button of element.querySelectorAll("[data-zoom]")) {
        button.addEventListener("click", () => this.zoom(Number(button.dataset.zoom)));
      }
      drawWhereThereIsRoom(element.querySelector(".charts"), () => this.draw());
    }

    async draw() {
      for (const canvas of this.element.querySelectorAll("[data-chart]")) {
        await this.embed(canvas, canvas.dataset.chart);
      }
      this.element.dataset.drawn = "true";
      if (this.focused) this.focus(this.focused);
    }

    async embed(canvas, name) {
      const spec = structuredClone(this.payload.charts[name]);
      for (const table of ["cursor", "focus_time", "focus_place"]) spec.datasets[table] = [];
      Object.assign(spec.datasets, this.tables);
      if (name === "map" && matchMedia("(pointer: coarse)").matches) {
        for (const layer of spec.layer) for (const param of layer.params || []) param.select.translate = false;
      }
      if (this.views[name]) this.views[name].finalize();
      this.views[name] = await embed(canvas, name, spec);
      const svg = canvas.querySelector("svg");
      if (name === "map") this.whole = ["view_east_m", "view_north_m"].map((key, axis) =>
        this.views.map.scale(axis ? "y" : "x").domain());
      else canvas.addEventListener("pointermove", (event) => {
        const time = this.views[name].scale("x").invert(
          (event.clientX - svg.getBoundingClientRect().left) * (svg.viewBox.baseVal.width || canvas.clientWidth)
            / svg.getBoundingClientRect().width - this.views[name].origin()[0]);
        if (time >= 0 && time <= this.end) {
          this.slider.value = String(Math.round(time / this.end * this.slider.max));
          this.look(time);
        }
      });
    }

    // The row of a table that is not later than a time.
    at(table, time) {
      let low = 0;
      for (let high = table.length - 1; low < high;) {
        const middle = Math.ceil((low + high) / 2);
        if (table[middle].time_min <= time) low = middle;
        else high = middle - 1;
      }
      return table[low];
    }

    look(time) {
      const row = this.at(this.tables.flight, time);
      for (const view of Object.values(this.views)) view.data("cursor", [row]).runAsync();
      const texts = [
        `${row.time_min.toFixed(2)} min`, `item ${row.item}, ${row.state}`,
        `${row.altitude_amsl_m.toFixed(0)} m AMSL`, `${row.speed_m_s.toFixed(1)} m/s`];
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
