// The words of the interface, from the table WORDS. What the user wrote is never translated.

const LANGUAGES = { en: "English", fr: "Français", de: "Deutsch", es: "Español", pt: "Português" };
let language = data.language;

// A line of the table has a key and its words, in the order of the languages.
const TABLE = new Map(WORDS.split("\n").map((line) => line.split("|")).map(([key, ...words]) => [key, words]));
const template = (key) => TABLE.get(key)[Object.keys(LANGUAGES).indexOf(language)];

// A word or a sentence, with values in the places that the table names in braces.
const word = (key, values = {}) => template(key).replace(/\{(\w+)\}/g, (_, name) => clean(values[name]));

// The same as a list of texts and elements: names of the user are elements, so that their direction does not move the words around them.
const phrase = (key, values) => template(key).split(/\{(\w+)\}/).map((part, at) => (at % 2 === 0 ? part : values[part])).filter((part) => part !== "");

// The sentence of an error: those of the engine have a key.
const told = (error) => (error.key ? word(error.key, error.values) : error.message);

// Writes all words that never change.
function fillWords() {
    document.documentElement.lang = language;
    for (const element of document.querySelectorAll("[data-word]")) {
        const key = element.querySelector("kbd");
        element.replaceChildren(word(element.dataset.word), ...(key ? [key] : []));
    }
    for (const element of document.querySelectorAll("[data-name]")) element.setAttribute("aria-label", word(element.dataset.name));
    byId("break-text").placeholder = word("condition");
}
