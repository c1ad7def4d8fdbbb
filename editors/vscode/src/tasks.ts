// Tasks of the workspace: check, generate, and build.

import * as vscode from "vscode";
import { find, include } from "./programs";

interface Definition extends vscode.TaskDefinition {
  readonly task: string;
}

export class Tasks implements vscode.TaskProvider {
  provideTasks(): vscode.Task[] {
    const folder = vscode.workspace.workspaceFolders?.[0];
    if (folder === undefined) {
      return [];
    }
    return ["check", "generate", "build"].flatMap((task) => {
      const made = this.task({ type: "robocomp", task }, folder);
      return made === undefined ? [] : [made];
    });
  }

  resolveTask(task: vscode.Task): vscode.Task | undefined {
    const folder = vscode.workspace.workspaceFolders?.[0];
    const definition = task.definition as Definition;
    return folder === undefined ? undefined : this.task(definition, folder);
  }

  private task(definition: Definition, folder: vscode.WorkspaceFolder): vscode.Task | undefined {
    const imports = include().flatMap((path) => ["-I", path]);
    let program: string | undefined = "cargo";
    let args: string[];
    switch (definition.task) {
      case "check":
        program = find("rcgen");
        args = ["check", "--format", "short", ...imports, "."];
        break;
      case "generate":
        program = find("rcgen");
        args = ["generate", "--format", "short", ...imports];
        break;
      case "build":
        args = ["build", "--release"];
        break;
      default:
        return undefined;
    }
    if (program === undefined) {
      return undefined;
    }
    const execution = new vscode.ProcessExecution(program, args, { cwd: folder.uri.fsPath });
    const task = new vscode.Task(definition, folder, definition.task, "robocomp", execution, "$robocomp");
    task.group = vscode.TaskGroup.Build;
    return task;
  }
}
