// Texts of elements.

/** Write a text, unless it is there: the browser lays the page out anew even for the same. */
export function tell(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
