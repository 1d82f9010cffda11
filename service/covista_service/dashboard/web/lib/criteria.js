// The criteria by which the number of groups is chosen, each in one plain sentence, and what its score counts.
const CRITERIA = {
  adaptive: "Small groups are formed first and merged two by two; that stage is taken where robots are most alike to their own group compared with the next one.",
  silhouette: "Groups are made for every number; that number is taken where robots are most alike to their own group compared with the next one.",
  gain: "Robots move and groups merge as long as that brings together more alikeness than robots can expect; the number comes out by itself.",
  fiedler: "That number is taken at which the groups hang together best inside, on average; a robot alone counts nothing.",
  paper: "As the paper's Eq. 17: that number, of two or more, at which the groups hang together best inside, on average.",
  eigengap: "That number is taken after which the eigenvalues of the similarity fall most: so many groups stand out from the rest.",
  modularity: "That number is taken at which groups hold most similarity beyond what chance would put inside them.",
  components: "Nothing is chosen: a group is whoever hangs together by similarities above 0.6.",
};

const SCORES = {
  adaptive: "The score is the mean silhouette: 1 is as clear as can be, 0 is undecided, below 0 is wrong.",
  silhouette: "The score is the mean silhouette: 1 is as clear as can be, 0 is undecided, below 0 is wrong.",
  gain: "The score is what all groups together gain by standing together.",
  fiedler: "The score is the mean Fiedler value of the groups.",
  paper: "The score is the mean Fiedler value of the groups.",
  eigengap: "The score is how far the eigenvalues fall after that number.",
  modularity: "The score is the modularity: 0 is chance.",
  components: "The score is the mean silhouette of these groups.",
};

export const criterionSentence = (name) => CRITERIA[name] ?? "";
export const scoreSentence = (name) => SCORES[name] ?? "";
