// The light theme, for a hall in daylight and for paper: a switch, and the browser remembers it.
//
// The program sends each browser the colors that its cookie asks for (commission/app/base/relight.py): the page loads
// anew, and comes back with the same tabs, folders and camera (kept_view.js).
(() => {
  if (window.commissionDaylight) return; // the server sends this script again after each reconnection
  const COOKIE = "commission_theme", YEAR_S = 31_536_000;
  const isLight = document.cookie.split("; ").includes(`${COOKIE}=light`);
  document.documentElement.classList.toggle("c-light", isLight);
  window.commissionDaylight = () => {
    document.cookie = `${COOKIE}=${isLight ? "dark" : "light"}; path=/; max-age=${YEAR_S}; SameSite=Strict`;
    location.reload();
  };
  const button = document.createElement("button");
  button.className = "c-daylight";
  button.type = "button";
  button.textContent = isLight ? "☾" : "☀";
  button.title = isLight ? "Dark theme" : "Light theme, for daylight and for print";
  button.setAttribute("aria-label", isLight ? "Dark theme" : "Light theme");
  button.addEventListener("click", window.commissionDaylight);
  document.body.append(button);
})();
