// Whether the page is dark now; for `setup`.
import { onMounted, onUnmounted, ref } from "vue";
import { isDark } from "covista/looks.js";

export function onDark() {
  const dark = ref(isDark());
  const observer = new MutationObserver(() => (dark.value = isDark()));
  onMounted(() => {
    dark.value = isDark();
    observer.observe(document.body, { attributes: true, attributeFilter: ["class"] });
  });
  onUnmounted(() => observer.disconnect());
  return dark;
}
