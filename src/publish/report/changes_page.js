// A comparison by itself, where the later map has no report to stand in.

showChanges(JSON.parse(byId("data").textContent).changes, null);
byId("theme").addEventListener("click", () => {
  const root = document.documentElement;
  const now = root.dataset.theme ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  root.dataset.theme = now === "dark" ? "light" : "dark";
});
document.documentElement.dataset.ready = "true";
