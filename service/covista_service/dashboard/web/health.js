export default { template: "<p></p>" };
