// What lies over viser's page: tools, what is under the cursor, the lasso, legends, thumbnails and
// the time line. The server says what to show in an element of the panel; requests go back by GET
// with a header that no page of another site can send without being asked first.
"use strict";
(() => {
  const own = (name, values = {}) =>
    fetch(`/nrdf/${name}?` + new URLSearchParams({ client: client(), ...values }), {
      headers: { "X-NRDF": "1" },
    }).then((answer) => (answer.ok ? answer.json() : {}));
  const make = (tag, more = {}, inside = []) => {
    const made = Object.assign(document.createElement(tag), more);
    made.append(...inside);
    return made;
  };
  const client = () => document.querySelector("[data-nrdf-client]")?.dataset.nrdfClient ?? "";
  const narrow = () => innerWidth < 600;

  const root = make("section", { id: "nrdf", ariaLabel: "Tools and legends" });
  const tools = make("div", { id: "nrdf-tools", role: "toolbar", ariaLabel: "Tools" });
  const strip = make("nav", { id: "nrdf-strip", ariaLabel: "Targets" });
  const line = make("div", { id: "nrdf-line", role: "group", ariaLabel: "Time line" });
  const legend = make("ul", { id: "nrdf-legend", ariaLabel: "Colours" });
  const tip = make("div", { id: "nrdf-tip", role: "tooltip", hidden: true });
  const lasso = make("div", { id: "nrdf-lasso", hidden: true });
  root.append(make("h1", {}, ["nrdf studio"]), lasso, tools, legend, strip, line, tip);

  const looking = () =>
    narrow() || (client() && state.pen != null && String(state.pen) !== client());
  const canvas = () => document.querySelector("canvas");
  let state = {}, shown = "";

  function button(words, key, hint, pressed, act) {
    const made = make("button", { type: "button", title: hint, onclick: act }, [words]);
    if (key) made.append(make("kbd", {}, [key]));
    made.ariaLabel = words;
    if (pressed !== null) made.ariaPressed = String(pressed);
    return made;
  }

  function show() {
    const held = document.querySelector("[data-nrdf-state]")?.dataset.nrdfState;
    if (!held || client() + held === shown) return;
    shown = client() + held;
    state = JSON.parse(held);
    document.body.dataset.tool = state.tool;
    if (narrow() && client() && !root.dataset.phone) {
      root.dataset.phone = "is";
      own("only_look");
    }
    root.dataset.looks = looking() ? "only" : "";
    const another = [make("span", { className: "words" }, ["Another page changes this session."]),
      button("Work here", "", "Then the other page looks on", null, () => own("take_pen"))];
    tools.replaceChildren(...(looking() ? another : [
      ...state.tools.map(([name, key, hint]) =>
        button(name, key, hint, name === state.tool, () => own("tool", { name }))),
      button("Erase", state.erase_key, "Paint takes away instead", state.erase,
        () => own("act", { name: "Erase" })),
      make("span", { className: "gap" }),
      ...state.acts.map(([name, key, hint]) =>
        button(name, key, hint, null, () => own("act", { name })))]));
    legend.replaceChildren(...state.legend.map(([words, colour]) => {
      const chip = make("i");
      chip.style.background = colour;
      return make("li", {}, [chip, words]);
    }));
    legend.hidden = !state.legend.length;
    strip.replaceChildren(...state.targets.map(([name, words, stamp, chosen]) => {
      const made = make("button", { type: "button", title: words,
        onclick: () => own("target", { name: chosen ? "" : name }) });
      if (stamp) made.append(make("img", { alt: "", loading: "lazy",
        src: `/nrdf/thumbnail?name=${encodeURIComponent(name)}&at=${stamp}` }));
      made.append(make("span", {}, [words]));
      made.ariaPressed = String(chosen);
      return made;
    }));
    strip.hidden = state.targets.length < 2;
    line.replaceChildren(...state.line.map(([from, share, colour, words, bad]) => {
      const part = make("button", { type: "button", title: words, ariaLabel: words,
        className: bad ? "bad" : "", onclick: () => own("seek", { time: from }) });
      part.style.flexGrow = share;
      part.style.background = colour;
      return part;
    }));
    line.hidden = !state.line.length;
    lasso.hidden = state.tool !== "Lasso" || looking();
  }

  function place() {
    const box = canvas()?.getBoundingClientRect();
    if (!box) return;
    const panel = [...document.querySelectorAll("[role=tablist]")].pop()?.getBoundingClientRect();
    const right = panel && panel.left > box.left + 200 ? Math.min(box.right, panel.left) : box.right;
    Object.assign(root.style, { left: `${box.left}px`, top: `${box.top}px`,
      width: `${right - box.left}px`, height: `${box.height}px` });
    root.dataset.dark = document.documentElement.dataset.mantineColorScheme === "dark";
  }

  // Names for fields whose label viser ties to nothing, and for the parts of the page.
  function name_fields() {
    for (const label of document.querySelectorAll("label[for]")) {
      const words = label.textContent;
      const row = label.parentElement?.parentElement?.parentElement;
      for (const field of row?.querySelectorAll(
        "input:not([type=hidden]), [role=slider], [role=progressbar]") ?? [])
        if (!field.ariaLabel && field.id !== label.htmlFor) field.ariaLabel = words;
    }
    for (const bar of document.querySelectorAll("[role=progressbar]"))
      bar.ariaLabel ??= "Progress";
    for (const bare of document.querySelectorAll("button, [role=button]"))
      if (!bare.textContent.trim() && !bare.ariaLabel && !bare.title)
        bare.ariaLabel = bare.className.includes("closeButton") ? "Close" : "Fold panel";
    canvas()?.setAttribute("aria-label", "The objects");
    canvas()?.setAttribute("role", "img");
  }

  const share = (event) => {
    const box = canvas().getBoundingClientRect();
    return [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
  };

  let asking = false, moved = null;
  async function hover() {
    if (asking || !moved) return;
    const event = moved;
    [asking, moved] = [true, null];
    const [x, y] = share(event);
    const { text } = await own("hover", { x: x.toFixed(4), y: y.toFixed(4) }).catch(() => ({}));
    asking = false;
    tip.hidden = !text;
    tip.textContent = text ?? "";
    const box = root.getBoundingClientRect();
    tip.style.left = `${Math.min(event.clientX - box.left + 14, box.width - 230)}px`;
    tip.style.top = `${event.clientY - box.top + 16}px`;
    if (moved) setTimeout(hover, 60);
  }
  addEventListener("pointermove", (event) => {
    const on = event.target === lasso || canvas()?.parentElement.contains(event.target);
    if (!on || event.buttons || narrow()) { moved = null; tip.hidden = true; return; }
    moved = event;
    hover();
  });

  let outline = null;
  const draw = () => {
    const box = lasso.getBoundingClientRect();
    lasso.innerHTML = outline ? `<svg aria-hidden="true"><polygon points="${outline.map(
      ([, , x, y]) => `${x - box.left},${y - box.top}`).join(" ")}"/></svg>` : "";
  };
  lasso.onpointerdown = (event) => {
    lasso.setPointerCapture(event.pointerId);
    outline = [[...share(event), event.clientX, event.clientY]];
  };
  lasso.onpointermove = (event) => {
    if (!outline) return;
    const [, , x, y] = outline.at(-1);
    if (Math.hypot(event.clientX - x, event.clientY - y) < 4) return;
    outline.push([...share(event), event.clientX, event.clientY]);
    draw();
  };
  lasso.onpointerup = () => {
    const every = Math.ceil(outline.length / 200);
    const points = outline.filter((_, i) => i % every === 0)
      .map(([x, y]) => `${x.toFixed(4)},${y.toFixed(4)}`).join(";");
    outline = null;
    draw();
    own("lasso", { points });
  };
  lasso.onwheel = (event) => canvas().dispatchEvent(new WheelEvent("wheel", event));

  // A file that is dropped anywhere goes to the upload of the open tab that takes its kind.
  addEventListener("dragover", (event) => {
    if (event.dataTransfer?.types.includes("Files")) event.preventDefault();
  });
  addEventListener("drop", (event) => {
    const { files } = event.dataTransfer ?? {};
    if (!files?.length) return;
    event.preventDefault();
    if (looking()) return;
    const open = [...document.querySelectorAll("input[type=file]")]
      .filter((input) => input.nextElementSibling?.offsetParent);
    const ending = "." + files[0].name.split(".").pop().toLowerCase();
    const to = open.find((input) => input.accept.split(",").includes(ending)) ?? open[0];
    tip.hidden = Boolean(to);
    tip.textContent = "Drop files while 1 Reference, 4 Targets or 6 Robot is open";
    if (!to) return;
    to.files = files;
    to.dispatchEvent(new Event("change", { bubbles: true }));
  });

  // Who looks on changes nothing, not even on their own page.
  for (const kind of ["pointerdown", "mousedown", "click", "keydown"])
    addEventListener(kind, (event) => {
      const free = root.contains(event.target) || canvas()?.parentElement.contains(event.target) ||
        event.target.closest?.("[role=tab], [aria-label='Fold panel'], .mantine-Notification-root");
      if (!looking() || free || event.key === "Tab") return;
      event.stopPropagation();
      if (kind !== "pointerdown") event.preventDefault();
    }, true);

  addEventListener("DOMContentLoaded", () => {
    document.body.append(root);
    document.title = "nrdf studio";
    document.querySelector("#root")?.setAttribute("role", "main");
    let due = 0;
    new MutationObserver(() => {
      clearTimeout(due);
      due = setTimeout(() => { show(); place(); name_fields(); }, 60);
    }).observe(document.body, { childList: true, subtree: true, attributes: true,
      attributeFilter: ["data-nrdf-state", "data-nrdf-client"] });
    addEventListener("resize", () => { shown = ""; show(); place(); });
    setInterval(place, 500);
  });
})();
