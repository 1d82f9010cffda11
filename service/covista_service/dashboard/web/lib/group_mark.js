// A group as it looks everywhere: its shape, its colour and its label.
import { h } from "vue";
import { onDark } from "covista/dark.js";
import { colourOf, shapeOf } from "covista/looks.js";

const PATHS = {
  circle: "M8 2a6 6 0 1 0 0 12a6 6 0 1 0 0-12z",
  square: "M2.5 2.5h11v11h-11z",
  triangle: "M8 1.5l6.5 12h-13z",
  diamond: "M8 1l7 7l-7 7l-7-7z",
  pentagon: "M8 1.2l6.8 5l-2.6 8h-8.4l-2.6-8z",
  cross: "M5.5 1.5h5v4h4v5h-4v4h-5v-4h-4v-5h4z",
};

export default {
  props: { label: { type: String, default: null } },
  setup(props) {
    const dark = onDark();
    return () =>
      h("span", { class: "cv-mark" }, [
        h("svg", { viewBox: "0 0 16 16", width: 16, height: 16, "aria-hidden": "true" }, [
          h("path", { d: PATHS[shapeOf(props.label)], fill: colourOf(props.label, dark.value) }),
        ]),
        props.label ?? "no group",
      ]);
  },
};
