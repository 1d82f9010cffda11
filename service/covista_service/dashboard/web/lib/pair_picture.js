// The keyframe of one robot of a pair with what the other sees of it, or a word about why there is none.
import { computed } from "vue";

const NOTES = {
  features: "It sends no pictures, so its feature points stand here instead.",
  thumbnail: "It sends features with a small grey picture, enlarged here.",
};

export default {
  // `picture`: { png, problem } or null before the first; `kind`: what the robot sends.
  props: { picture: { type: Object, default: null }, words: String, kind: { type: String, default: null } },
  setup(props) {
    const url = computed(() => (props.picture?.png ? `data:image/png;base64,${props.picture.png}` : null));
    const problem = computed(() => {
      if (!props.picture) return "Asking the station for the picture.";
      const words = props.picture.problem;
      return `No picture: ${words}.`;
    });
    return { url, problem, NOTES };
  },
  template: `
    <figure class="cv-picture">
      <img v-if="url" :src="url" :alt="words">
      <div v-else class="cv-no-picture"><p>{{ problem }}</p></div>
      <figcaption><slot></slot><span v-if="url && NOTES[kind]" class="cv-soft">{{ NOTES[kind] }}</span></figcaption>
    </figure>`,
};
