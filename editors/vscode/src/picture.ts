// The network as a picture beside its .ddsl: `rcdeploy graph` draws it.

import { randomBytes } from "node:crypto";
import * as path from "node:path";
import * as vscode from "vscode";
import { componentOf, harmless, pathAt, symbolAt } from "./places";
import { run } from "./programs";

/** How long nothing may be typed before the picture is drawn, and how often a running network is drawn. */
const PAUSE = 300;
const LIVE = 2000;

/** A picture, and what it shows. */
export class Picture implements vscode.Disposable {
  private static open: Picture | undefined;

  private readonly panel: vscode.WebviewPanel;
  private readonly parts: vscode.Disposable[] = [];
  private timer: NodeJS.Timeout | undefined;
  private live: NodeJS.Timeout | undefined;
  private drawing = false;

  private constructor(private document: vscode.TextDocument) {
    this.panel = vscode.window.createWebviewPanel(
      "robocomp.picture",
      "Network",
      { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true },
      { enableScripts: true, localResourceRoots: [] },
    );
    this.panel.webview.html = page();
    this.parts.push(
      this.panel.onDidDispose(() => this.dispose()),
      this.panel.webview.onDidReceiveMessage((message: unknown) => this.clicked(message)),
      vscode.workspace.onDidSaveTextDocument(() => this.drawSoon()),
      vscode.languages.onDidChangeDiagnostics(() => this.findings()),
      vscode.window.onDidChangeTextEditorSelection((event) => this.follow(event.textEditor)),
      vscode.window.onDidChangeActiveTextEditor((editor) => {
        if (editor?.document.languageId === "ddsl") {
          this.document = editor.document;
          this.drawSoon();
        }
      }),
    );
    this.drawSoon();
  }

  static show(document: vscode.TextDocument): void {
    if (Picture.open === undefined) {
      Picture.open = new Picture(document);
    } else {
      Picture.open.document = document;
      Picture.open.drawSoon();
      Picture.open.panel.reveal(undefined, true);
    }
  }

  dispose(): void {
    Picture.open = undefined;
    clearTimeout(this.timer);
    clearInterval(this.live);
    this.parts.forEach((part) => part.dispose());
  }

  private drawSoon(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => void this.draw(), PAUSE);
  }

  private async draw(): Promise<void> {
    if (this.drawing) {
      return;
    }
    this.drawing = true;
    const file = this.document.uri.fsPath;
    const args = ["graph", file, "--unbuilt", ...(this.live === undefined ? [] : ["--live"])];
    const output = await run("rcdeploy", args, path.dirname(file));
    this.drawing = false;
    const svg = harmless(output.out);
    this.panel.title = path.basename(file);
    await this.panel.webview.postMessage({ svg, error: svg === "" ? output.err : "" });
    this.findings();
  }

  /** How many findings the file has: its picture marks them, as of the last save. */
  private findings(): void {
    const found = vscode.languages.getDiagnostics(this.document.uri);
    const errors = found.filter((one) => one.severity === vscode.DiagnosticSeverity.Error).length;
    void this.panel.webview.postMessage({ errors, warnings: found.length - errors });
  }

  private async symbols(): Promise<vscode.DocumentSymbol[]> {
    const symbols = await vscode.commands.executeCommand<vscode.DocumentSymbol[] | undefined>(
      "vscode.executeDocumentSymbolProvider",
      this.document.uri,
    );
    return symbols ?? [];
  }

  /** Marks the component at the cursor. */
  private async follow(editor: vscode.TextEditor): Promise<void> {
    if (editor.document !== this.document) {
      return;
    }
    const at = editor.selection.active;
    const around: { name: string; isPart: boolean }[] = [];
    let all = (await this.symbols())[0]?.children ?? [];
    for (;;) {
      const inner = all.find((symbol) => symbol.range.contains(at));
      if (inner === undefined) {
        break;
      }
      // Groups and components are steps of a path, processes and hosts none.
      const isPart = [vscode.SymbolKind.Module, vscode.SymbolKind.Object].includes(inner.kind);
      around.push({ name: inner.name, isPart });
      all = inner.children;
    }
    await this.panel.webview.postMessage({ at: pathAt(around) });
  }

  /** A click goes to the line of a component; a button starts, stops, or turns the live picture on. */
  private async clicked(message: unknown): Promise<void> {
    const { title, action } = message as { title?: string; action?: string };
    if (action === "live") {
      if (this.live === undefined) {
        this.live = setInterval(() => void this.draw(), LIVE);
      } else {
        clearInterval(this.live);
        this.live = undefined;
      }
      this.drawSoon();
      return;
    }
    const component = componentOf(title ?? "");
    if (component === undefined) {
      return;
    }
    if (action === "start" || action === "stop") {
      const file = this.document.uri.fsPath;
      const output = await run("rcdeploy", [action, file, component], path.dirname(file));
      if (output.code !== 0) {
        void vscode.window.showErrorMessage(output.err.trim());
      }
      this.drawSoon();
      return;
    }
    const symbol = symbolAt(await this.symbols(), component);
    if (symbol !== undefined) {
      await vscode.window.showTextDocument(this.document, {
        viewColumn: vscode.ViewColumn.One,
        selection: symbol.selectionRange,
      });
    }
  }
}

/** The page: it draws what it is sent, and sends back what is clicked. */
function page(): string {
  const nonce = randomBytes(16).toString("hex");
  return `<!DOCTYPE html>
<html>
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy"
  content="default-src 'none'; style-src 'unsafe-inline'; script-src 'nonce-${nonce}'">
<style>
  body { background: white; color: #222222; }
  #picture g:has(> title) { cursor: pointer; }
  #picture g.here > rect { stroke: #0060c0; stroke-width: 3; }
  #picture g.chosen > rect { stroke-dasharray: 4 2; }
  #error { white-space: pre-wrap; color: #b00020; }
</style>
</head>
<body>
<p><button id="live">Live</button> <button id="start" disabled>Start</button>
<button id="stop" disabled>Stop</button> <span id="found"></span></p>
<div id="picture"></div><div id="error"></div>
<script nonce="${nonce}">
const editor = acquireVsCodeApi();
const by = (id) => document.getElementById(id);
const titled = (node) => node.closest && node.closest("g:has(> title)");
const title = (node) => node.querySelector(":scope > title").textContent;
let at = "", chosen = "", live = false;
function mark() {
  for (const node of by("picture").querySelectorAll("g:has(> title)")) {
    node.classList.toggle("here", at !== "" && title(node).startsWith(at + ":"));
    node.classList.toggle("chosen", chosen !== "" && title(node) === chosen);
  }
  by("start").disabled = by("stop").disabled = !live || chosen === "";
}
window.addEventListener("message", ({ data }) => {
  if (data.svg !== undefined) {
    const svg = new DOMParser().parseFromString(data.svg, "image/svg+xml").documentElement;
    by("picture").replaceChildren(...(data.svg === "" ? [] : [document.importNode(svg, true)]));
    by("error").textContent = data.error;
  }
  if (data.at !== undefined) { at = data.at; }
  if (data.errors !== undefined) {
    by("found").textContent = data.errors + " errors, " + data.warnings + " others in the file";
  }
  mark();
});
by("picture").addEventListener("click", ({ target }) => {
  const node = titled(target);
  if (!node) { return; }
  chosen = title(node);
  mark();
  editor.postMessage({ title: chosen });
});
by("live").addEventListener("click", () => {
  live = !live;
  by("live").textContent = live ? "As described" : "Live";
  mark();
  editor.postMessage({ action: "live" });
});
for (const action of ["start", "stop"]) {
  by(action).addEventListener("click", () => editor.postMessage({ action, title: chosen }));
}
</script>
</body>
</html>`;
}
