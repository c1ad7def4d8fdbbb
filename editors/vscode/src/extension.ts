// The extension: a client of `rcgen lsp`, and commands that start rcgen and rcdeploy.

import * as path from "node:path";
import * as vscode from "vscode";
import { LanguageClient, type Location, type Position } from "vscode-languageclient/node";
import { Entry, Networks } from "./networks";
import { Picture } from "./picture";
import { find, include, run, show } from "./programs";
import { Tasks } from "./tasks";

const LANGUAGES = ["idsl", "cdsl", "pdsl", "smdsl", "ddsl", "gdsl", "dproto", "kdsl", "robocomp-graph"];

let client: LanguageClient | undefined;

export async function activate(context: vscode.ExtensionContext): Promise<void> {
  const networks = new Networks();
  const command = (name: string, does: (...args: never[]) => unknown): void => {
    context.subscriptions.push(vscode.commands.registerCommand(name, does));
  };
  command("rcgen.generate", (uri?: string) => terminal("rcgen", "cdsl", uri, (file) => [file]));
  command("rcgen.missing", (uri?: string) =>
    terminal("rcgen", "cdsl", uri, (file) => ["stubs", file]),
  );
  command("rcgen.updateConfiguration", (uri?: string) =>
    terminal("rcgen", "toml", uri, (file) => ["config", "--update", file]),
  );
  command("rcgen.checkNetwork", (uri?: string) =>
    terminal("rcdeploy", "ddsl", uri, (file) => ["check", file]),
  );
  command("rcgen.up", (uri?: string) =>
    terminal("rcdeploy", "ddsl", uri, (file) => ["up", "--build", file]),
  );
  command("rcgen.down", (uri?: string) => terminal("rcdeploy", "ddsl", uri, (file) => ["down", file]));
  command("robocomp.build", async () => {
    const tasks = await vscode.tasks.fetchTasks({ type: "robocomp" });
    const build = tasks.find((task) => task.name === "build");
    if (build !== undefined) {
      await vscode.tasks.executeTask(build);
    }
  });
  command("robocomp.check", () => {
    const folder = vscode.workspace.workspaceFolders?.[0];
    if (folder !== undefined) {
      show("rcgen", ["check", "."], folder.uri.fsPath);
    }
  });
  command("robocomp.newComponent", newComponent);
  command("robocomp.explain", explain);
  command("robocomp.picture", () => {
    const document = vscode.window.activeTextEditor?.document;
    if (document?.languageId === "ddsl") {
      Picture.show(document);
    }
  });
  command("robocomp.refresh", () => networks.refresh());
  command("robocomp.restart", async () => {
    await client?.stop();
    client = undefined;
    await start();
  });
  for (const action of ["start", "stop"] as const) {
    command(`robocomp.${action}Component`, async (entry: Entry) => {
      const file = entry.network.fsPath;
      const args = [action, file, entry.component ?? ""];
      const output = await run("rcdeploy", args, path.dirname(file));
      if (output.code !== 0) {
        void vscode.window.showErrorMessage(output.err.trim());
      }
      networks.refresh();
    });
  }
  // The lenses of the server have places of the protocol.
  command("rcgen.showPlaces", (uri: string, position: Position, places: Location[]) => {
    const converter = client?.protocol2CodeConverter;
    if (converter !== undefined) {
      void vscode.commands.executeCommand(
        "editor.action.showReferences",
        vscode.Uri.parse(uri),
        converter.asPosition(position),
        places.map((place) => converter.asLocation(place)),
      );
    }
  });
  context.subscriptions.push(
    vscode.window.registerTreeDataProvider("robocomp.networks", networks),
    vscode.tasks.registerTaskProvider("robocomp", new Tasks()),
    vscode.workspace.onDidSaveTextDocument((document) => {
      if (document.languageId === "ddsl") {
        networks.refresh();
      }
    }),
  );
  await start();
}

export async function deactivate(): Promise<void> {
  await client?.stop();
}

/** Starts the language server. */
async function start(): Promise<void> {
  const program = find("rcgen");
  if (program === undefined) {
    return;
  }
  const args = ["lsp", ...include().flatMap((folder) => ["-I", folder])];
  const files = [
    ...LANGUAGES.map((language) => ({ scheme: "file", language })),
    ...["**/etc/*.toml", "**/src/**/*.rs", "**/src/**/*.py", "**/*.{ilk,scxml,urdf,xml}"].map(
      (pattern) => ({ scheme: "file", pattern }),
    ),
  ];
  client = new LanguageClient(
    "robocomp",
    "RoboComp",
    { command: program, args },
    { documentSelector: files, diagnosticCollectionName: "robocomp" },
  );
  try {
    await client.start();
  } catch (error) {
    void vscode.window.showErrorMessage(`${program} lsp does not start: ${String(error)}`);
  }
}

/** Runs a program on a file: the one of a lens, or the open one. */
async function terminal(
  name: "rcgen" | "rcdeploy",
  language: string,
  uri: string | undefined,
  args: (file: string) => string[],
): Promise<void> {
  const open = vscode.window.activeTextEditor?.document;
  const file = uri === undefined ? open?.uri : vscode.Uri.parse(uri);
  if (file === undefined || !file.path.endsWith(`.${language}`)) {
    void vscode.window.showErrorMessage(`Open a .${language} file first.`);
    return;
  }
  // The programs read what is saved.
  await vscode.workspace.saveAll(false);
  show(name, args(file.fsPath), path.dirname(file.fsPath));
}

async function newComponent(): Promise<void> {
  const folder = vscode.workspace.workspaceFolders?.[0];
  if (folder === undefined) {
    void vscode.window.showErrorMessage("Open a folder first.");
    return;
  }
  const name = await vscode.window.showInputBox({
    title: "Name of the component",
    validateInput: (text) => (/^[A-Za-z_]\w*$/.test(text) ? "" : "Letters, digits and `_`"),
  });
  const language = name && (await vscode.window.showQuickPick(["rust", "python"], { title: "Language" }));
  if (name && language) {
    show("rcgen", ["new", name, "--language", language], folder.uri.fsPath);
  }
}

/** The page of the finding at the cursor, or of one that the user names. */
async function explain(): Promise<void> {
  const editor = vscode.window.activeTextEditor;
  const here = editor && vscode.languages.getDiagnostics(editor.document.uri).find(
    (found) => found.source === "rcgen" && found.range.contains(editor.selection.active),
  );
  const code = typeof here?.code === "string"
    ? here.code
    : await vscode.window.showInputBox({ title: "Code of the finding, such as unknown-type" });
  if (!code) {
    return;
  }
  const output = await run("rcgen", ["explain", code], process.cwd());
  if (output.code !== 0) {
    void vscode.window.showErrorMessage(output.err.trim());
    return;
  }
  // It begins with the code.
  const content = `# ${output.out}`;
  const page = await vscode.workspace.openTextDocument({ language: "markdown", content });
  await vscode.commands.executeCommand("markdown.showPreviewToSide", page.uri);
}
