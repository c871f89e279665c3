// What screen readers and the keyboard need and the theme leaves out
for (const caption of document.querySelectorAll(".caption[role=heading]")) caption.ariaLevel = "2";
document.querySelector(".sidebar-drawer")?.setAttribute("aria-label", "Contents of the site");
document.querySelector(".toc-drawer")?.setAttribute("aria-label", "On this page");
for (const code of document.querySelectorAll(".highlight pre, .table-wrapper")) code.tabIndex = 0; // may scroll
for (const head of document.querySelectorAll("th")) if (!head.textContent.trim()) head.role = "none";
