// The page of a file: its record stands in it.

followSystemTheme();
const app = new App(JSON.parse(byId("data").textContent), { Controls, Panels, Bases });
