// Lists the files that were given to the page, with their kinds. Each has a button that removes it.

const UNREADABLE = "it is a folder, or was changed or moved after it was given. Give it again, or what is in the folder";

export class Held {
  #files = new Map(); // {name: file}, in the order in which they were given
  #found = { kinds: {}, why: {} };
  #place;
  #removed;

  /** place: the <details> element for the list. removed() is called when a file was removed. */
  constructor(place, removed) {
    this.#place = place;
    this.#removed = removed;
  }

  add(files) {
    for (const file of files) {
      this.#files.delete(file.name); // of files with the same name, the last one counts
      this.#files.set(file.name, file);
    }
  }

  get files() {
    return [...this.#files.values()];
  }

  /** Return the files that the browser can read. For each other file, why[name] gets the reason. */
  async readable(why) {
    const tried = await Promise.allSettled(this.files.map((file) => file.slice(0, 1).arrayBuffer()));
    return this.files.filter(({ name }, k) => {
      if (tried[k].status === "rejected") why[name] = `${name} cannot be read: ${UNREADABLE}`;
      return tried[k].status === "fulfilled";
    });
  }

  file(name) {
    return this.#files.get(name);
  }

  /** Show the list. found: {kinds: {name: kind}, why: {name: reason why it cannot be used}}, for files that were
   * identified. */
  show(found = this.#found) {
    this.#found = found;
    const { kinds, why } = found;
    const rows = this.files.map((file) => this.#row(file, kinds[file.name], why[file.name]));
    this.#place.querySelector("ul").replaceChildren(...rows.toReversed()); // the newest file first
    const wrong = this.files.filter(({ name }) => why[name]).length;
    const count = rows.length === 1 ? "1 file" : `${rows.length} files`;
    this.#place.querySelector("summary").textContent = wrong ? `${count}, ${wrong} cannot be used` : count;
    if (wrong) this.#place.open = true;
    this.#place.hidden = !rows.length;
  }

  #row(file, kind, why) {
    const row = document.createElement("li");
    const remove = document.createElement("button");
    remove.type = "button";
    remove.textContent = "Remove";
    remove.ariaLabel = `Remove ${file.name}`;
    remove.addEventListener("click", () => {
      this.#files.delete(file.name);
      this.#removed();
    });
    const name = document.createElement("strong");
    name.textContent = file.name;
    const words = document.createElement("span");
    words.textContent = why ? without(file.name, why) : [kind, size(file.size)].filter(Boolean).join(", ");
    row.classList.toggle("wrong", Boolean(why));
    row.append(name, words, remove);
    return row;
  }
}

/** Remove the file's name from the reason, because the list shows it beside the reason. */
function without(name, why) {
  const words = why.startsWith(name) ? why.slice(name.length).replace(/^:? /, "") : why;
  return /[.?!]$/.test(words) ? words : `${words}.`;
}

export function size(bytes) {
  return bytes < 1e5 ? `${Math.ceil(bytes / 1e3)} kB` : `${(bytes / 1e6).toFixed(1)} MB`;
}
