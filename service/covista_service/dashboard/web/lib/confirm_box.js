// Asks once more before something is done: a dialog of the browser's own, which keeps the keyboard inside.
import { ref, watch } from "vue";

let boxes = 0;

export default {
  props: { open: Boolean, title: { type: String, required: true }, action: { type: String, required: true }, busy: Boolean },
  emits: ["confirm", "close"],
  setup(props) {
    const box = ref(null);
    const titleId = `cv-dialog-title-${++boxes}`;
    watch(() => props.open, (open) => {
      if (open && !box.value.open) box.value.showModal();
      if (!open && box.value.open) box.value.close();
    }, { flush: "post" });
    return { box, titleId };
  },
  template: `
    <dialog ref="box" class="cv-dialog" :aria-labelledby="titleId" @close="$emit('close')">
      <h2 :id="titleId">{{ title }}</h2>
      <slot></slot>
      <p class="cv-pick">
        <button type="button" autofocus @click="$emit('close')">Leave it</button>
        <button type="button" class="cv-main-action" :disabled="busy" @click="$emit('confirm')">{{ action }}</button>
      </p>
    </dialog>`,
};
