// The view of networks and their components, with the states of those that run.

import * as path from "node:path";
import * as vscode from "vscode";
import { run } from "./programs";

/** How many networks are listed. */
const MOST = 200;

/** A network, or a component of one. */
export class Entry extends vscode.TreeItem {
  constructor(
    readonly network: vscode.Uri,
    readonly component: string | undefined,
    label: string,
    range: vscode.Range | undefined,
    state: string | undefined,
  ) {
    const none = vscode.TreeItemCollapsibleState;
    super(label, component === undefined ? none.Collapsed : none.None);
    this.contextValue = component === undefined ? "network" : "component";
    this.iconPath = new vscode.ThemeIcon(component === undefined ? "type-hierarchy" : "circuit-board");
    if (state !== undefined) {
      this.description = state;
    }
    const options = range === undefined ? {} : { selection: range };
    this.command = { command: "vscode.open", title: "Open", arguments: [network, options] };
  }
}

/** One component of a running network, as `rcdeploy status` tells it. */
interface Running {
  readonly name?: string;
  readonly state?: string;
}

export class Networks implements vscode.TreeDataProvider<Entry> {
  private readonly changed = new vscode.EventEmitter<undefined>();
  readonly onDidChangeTreeData = this.changed.event;

  refresh(): void {
    this.changed.fire(undefined);
  }

  getTreeItem(entry: Entry): Entry {
    return entry;
  }

  async getChildren(entry?: Entry): Promise<Entry[]> {
    if (entry === undefined) {
      const files = await vscode.workspace.findFiles("**/*.ddsl", "**/{target,generated}/**", MOST);
      files.sort((one, other) => one.path.localeCompare(other.path));
      return files.map((file) => {
        const name = vscode.workspace.asRelativePath(file);
        return new Entry(file, undefined, name, undefined, undefined);
      });
    }
    if (entry.component !== undefined) {
      return [];
    }
    const symbols = await vscode.commands.executeCommand<vscode.DocumentSymbol[] | undefined>(
      "vscode.executeDocumentSymbolProvider",
      entry.network,
    );
    const states = await this.states(entry.network.fsPath);
    return (symbols ?? []).flatMap((network) => components(network.children, "")).map(
      ({ name, range }) => new Entry(entry.network, name, name, range, states.get(name)),
    );
  }

  private async states(file: string): Promise<Map<string, string>> {
    const output = await run("rcdeploy", ["status", file, "--format", "json"], path.dirname(file));
    const states = new Map<string, string>();
    if (output.code !== 0) {
      return states;
    }
    try {
      const status = JSON.parse(output.out) as { components?: Running[] };
      for (const { name, state } of status.components ?? []) {
        if (name !== undefined && state !== undefined) {
          states.set(name, state);
        }
      }
    } catch {
      // Another version of rcdeploy: the view has no states.
    }
    return states;
  }
}

function components(
  symbols: readonly vscode.DocumentSymbol[],
  prefix: string,
): { name: string; range: vscode.Range }[] {
  return symbols.flatMap((symbol) => {
    switch (symbol.kind) {
      case vscode.SymbolKind.Object:
        return [{ name: prefix + symbol.name, range: symbol.selectionRange }];
      case vscode.SymbolKind.Module:
        return components(symbol.children, `${prefix}${symbol.name}.`);
      default:
        return components(symbol.children, prefix);
    }
  });
}
