// The programs rcgen and rcdeploy.

import { execFile } from "node:child_process";
import * as vscode from "vscode";
import { program } from "./places";

/** The longest output of a program, in bytes, and its longest time, in milliseconds. */
const LONGEST = 16 << 20;
const LIMIT = 30_000;

export function include(): string[] {
  return vscode.workspace.getConfiguration("robocomp").get<string[]>("include", []);
}

/** Looks for a program, and tells the user where it was looked for. */
export function find(name: "rcgen" | "rcdeploy"): string | undefined {
  const setting = vscode.workspace.getConfiguration("robocomp").get<string>(name, "");
  const folders = (vscode.workspace.workspaceFolders ?? []).map((folder) => folder.uri.fsPath);
  const found = program(name, setting, process.env["PATH"] ?? "", folders);
  if (found === undefined) {
    void vscode.window.showErrorMessage(
      `${name} is neither on PATH nor built in this workspace. ` +
        "`cargo xtask install` installs it; the setting robocomp." + name + " names it.",
    );
  }
  return found;
}

/** What a program wrote. */
export interface Output {
  readonly code: number;
  readonly out: string;
  readonly err: string;
}

/** Runs a program to its end. */
export function run(name: "rcgen" | "rcdeploy", args: string[], cwd: string): Promise<Output> {
  const file = find(name);
  if (file === undefined) {
    return Promise.resolve({ code: 127, out: "", err: `${name} was not found` });
  }
  return new Promise((resolve) => {
    execFile(file, args, { cwd, maxBuffer: LONGEST, timeout: LIMIT }, (error, out, err) => {
      const code = error === null ? 0 : typeof error.code === "number" ? error.code : 1;
      resolve({ code, out, err: err === "" && error !== null ? error.message : err });
    });
  });
}

/** Runs a program where the user sees it. */
export function show(name: "rcgen" | "rcdeploy", args: string[], cwd: string): void {
  const file = find(name);
  if (file === undefined) {
    return;
  }
  const terminal = vscode.window.createTerminal({
    name: `${name} ${args[0] ?? ""}`,
    cwd,
    shellPath: file,
    shellArgs: args,
    isTransient: true,
  });
  terminal.show(true);
}
