// A comparison by itself, where the later map has no report to stand in.

showChanges(JSON.parse(byId("data").textContent).changes, null);
themeButton();
document.documentElement.dataset.ready = "true";
