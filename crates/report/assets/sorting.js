// A click on a header of a sortable table sorts by that column; a second one the other way round.
(() => {
  'use strict';
  const compared = (a, b) => {
    const [x, y] = [parseFloat(a), parseFloat(b)];
    if (Number.isNaN(x) || Number.isNaN(y)) return Number.isNaN(x) - Number.isNaN(y) || a.localeCompare(b);
    return x - y;
  };
  document.querySelectorAll('table.sortable').forEach(table => {
    const headers = [...table.tHead.rows[0].cells], body = table.tBodies[0];
    headers.forEach((header, column) => {
      const button = document.createElement('button');
      button.type = 'button';
      button.textContent = header.textContent;
      header.replaceChildren(button);
      button.onclick = () => {
        const sign = header.getAttribute('aria-sort') === 'ascending' ? -1 : 1;
        headers.forEach(other => other.removeAttribute('aria-sort'));
        header.setAttribute('aria-sort', sign > 0 ? 'ascending' : 'descending');
        const text = row => row.cells[column].textContent;
        body.append(...[...body.rows].sort((a, b) => sign * compared(text(a), text(b))));
      };
    });
  });
})();
