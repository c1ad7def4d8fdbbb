// Places in texts and pictures, without the editor: the tests run this module alone.

import * as fs from "node:fs";
import * as path from "node:path";

/** Looks for a program: the path of the settings, then PATH, then what cargo built in one of `folders`. */
export function program(
  name: string,
  setting: string,
  searchPath: string,
  folders: readonly string[],
): string | undefined {
  if (setting !== "") {
    return setting;
  }
  const onPath = searchPath.split(path.delimiter).filter((folder) => folder !== "");
  const built = folders.flatMap((folder) =>
    ["release", "debug"].map((profile) => path.join(folder, "target", profile)),
  );
  return [...onPath, ...built].map((folder) => path.join(folder, name)).find(isProgram);
}

function isProgram(file: string): boolean {
  try {
    fs.accessSync(file, fs.constants.X_OK);
    return fs.statSync(file).isFile();
  } catch {
    return false;
  }
}

/** The path of a component, or the first end of a connection, in the title of a part of a picture. */
export function componentOf(title: string): string | undefined {
  const end = /^([A-Za-z_][\w.]*?)(?::| calls | receives | \()/.exec(title);
  if (end?.[1] === undefined) {
    return undefined;
  }
  // Of a connection, the title begins with a slot.
  const isConnection = / (calls|receives) /.test(title.slice(0, title.indexOf(":") + 1));
  return isConnection ? end[1].slice(0, end[1].lastIndexOf(".")) : end[1];
}

/** A symbol of a file, as the editor has it. */
export interface Named {
  readonly name: string;
  readonly children: readonly Named[];
}

/** The symbols that lead to a component by its path in a network, from outside to inside. */
export function symbolAt<T extends Named & { readonly children: readonly T[] }>(
  symbols: readonly T[],
  component: string,
): T | undefined {
  const steps = component.split(".");
  const below = (all: readonly T[], at: number): T | undefined => {
    for (const symbol of all) {
      const next = symbol.name === steps[at] ? at + 1 : at;
      const found = next === steps.length ? symbol : below(symbol.children, next);
      if (found !== undefined) {
        return found;
      }
    }
    return undefined;
  };
  return below(symbols, 0);
}

/** The path of the component around a line, by the symbols around it. */
export function pathAt(around: readonly { readonly name: string; readonly isPart: boolean }[]): string {
  return around
    .filter((symbol) => symbol.isPart)
    .map((symbol) => symbol.name)
    .join(".");
}

/** A picture without anything that could run: it comes from a program, but shows texts of files. */
export function harmless(svg: string): string {
  const start = svg.indexOf("<svg");
  return (start < 0 ? "" : svg.slice(start)).replace(/<script[\s\S]*?<\/script>/gi, "");
}
