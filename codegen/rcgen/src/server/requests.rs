//! The requests that are answered.

use super::completion::Completion;
use super::place::Encoding;
use super::{METHOD_NOT_FOUND, Server, actions, hints, layout, outline, signature, tokens};
use serde_json::{Value, json};
use std::io;
use std::path::Path;

/// The files that an answer needs.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Needs {
    /// The file itself, as it is typed.
    File,
    /// All files, but not as of the last moment: once they were checked.
    Known,
    /// All files as they are typed.
    All,
}

/// The requests about a file.
const REQUESTS: [(&str, Needs); 19] = [
    ("completion", Needs::Known),
    ("formatting", Needs::File),
    ("codeAction", Needs::File),
    ("hover", Needs::Known),
    ("definition", Needs::All),
    ("implementation", Needs::All),
    ("references", Needs::All),
    ("documentHighlight", Needs::File),
    ("documentSymbol", Needs::File),
    ("foldingRange", Needs::File),
    ("selectionRange", Needs::File),
    ("semanticTokens/full", Needs::File),
    ("signatureHelp", Needs::Known),
    ("inlayHint", Needs::Known),
    ("codeLens", Needs::Known),
    ("prepareRename", Needs::All),
    ("rename", Needs::All),
    ("rangeFormatting", Needs::File),
    ("onTypeFormatting", Needs::File),
];

/// The capabilities of this server.
pub(super) fn capabilities(encoding: Encoding) -> Value {
    // A watcher of files gets no events about folders that are created, moved or deleted.
    let folders_only = json!({ "filters": [
        { "scheme": "file", "pattern": { "glob": "**/*", "matches": "folder" } },
    ] });
    json!({
        "capabilities": {
            "positionEncoding": encoding.word(),
            "textDocumentSync": { "openClose": true, "change": 2, "save": true },
            "documentFormattingProvider": true,
            "documentRangeFormattingProvider": true,
            "documentOnTypeFormattingProvider": {
                "firstTriggerCharacter": layout::SIGNS[0],
                "moreTriggerCharacter": &layout::SIGNS[1..],
            },
            "renameProvider": { "prepareProvider": true },
            "codeActionProvider": { "codeActionKinds": ["quickfix", "source.fixAll"] },
            "hoverProvider": true,
            "completionProvider": { "triggerCharacters": [".", "\"", ":", "@", "/", "<"] },
            "definitionProvider": true,
            "implementationProvider": true,
            "referencesProvider": true,
            "documentHighlightProvider": true,
            "documentSymbolProvider": true,
            "workspaceSymbolProvider": true,
            "foldingRangeProvider": true,
            "selectionRangeProvider": true,
            "semanticTokensProvider": {
                "legend": { "tokenTypes": tokens::KINDS, "tokenModifiers": tokens::MODIFIERS },
                "full": true,
            },
            "signatureHelpProvider": { "triggerCharacters": [" ", "."] },
            "inlayHintProvider": true,
            "codeLensProvider": {},
            "workspace": { "fileOperations": {
                "didCreate": folders_only,
                "didRename": folders_only,
                "didDelete": folders_only,
            } },
        },
        "serverInfo": { "name": "rcgen", "version": env!("CARGO_PKG_VERSION") },
    })
}

/// An answer: a result, or the code of an error with its message.
pub(super) type Answer = Result<Value, (i64, String)>;

impl Server {
    /// Answers a request, after checking the files that it concerns.
    pub(super) fn request(&mut self, method: &str, parameters: &Value) -> io::Result<Answer> {
        if method == "workspace/symbol" {
            self.settle()?;
            let query = parameters["query"].as_str().unwrap_or_default();
            return Ok(Ok(outline::symbols_like(&self.files, &self.editor, query)));
        }
        let name = method.strip_prefix("textDocument/");
        let Some((name, needs)) = REQUESTS.iter().find(|(known, _)| name == Some(known)) else {
            return Ok(Err((
                METHOD_NOT_FOUND,
                format!("`{method}` is not offered"),
            )));
        };
        let uri = parameters["textDocument"]["uri"].as_str();
        let uri = uri.unwrap_or_default();
        let Some(path) = self.editor.at(uri).map(|open| open.path.clone()) else {
            return Ok(Ok(Value::Null));
        };
        self.dirty.insert(path.clone());
        for path in std::mem::take(&mut self.dirty) {
            if self.waiting.remove(&path) {
                self.check(&path)?;
            }
        }
        match needs {
            Needs::All => self.settle()?,
            Needs::Known if !self.settled => self.settle()?,
            Needs::Known | Needs::File => {}
        }
        self.answer(name, uri, &path, parameters)
    }

    /// Checks all that waits.
    pub(super) fn settle(&mut self) -> io::Result<()> {
        while !self.waiting.is_empty() || !self.folders.is_empty() {
            self.work()?;
        }
        self.settled = true;
        Ok(())
    }

    fn answer(
        &mut self,
        name: &str,
        uri: &str,
        path: &Path,
        parameters: &Value,
    ) -> io::Result<Answer> {
        let (position, range) = (&parameters["position"], &parameters["range"]);
        let (files, editor) = (&self.files, &self.editor);
        Ok(Ok(match name {
            "formatting" => actions::format(editor, uri),
            "codeAction" => {
                let context = &parameters["context"];
                actions::actions((files, editor), &self.findings, path, range, context)
            }
            "completion" => Completion { files, editor }.at(path, position),
            "definition" => self.definition(path, position),
            "implementation" => self.implementation(path, position),
            "references" => {
                let declared = parameters["context"]["includeDeclaration"] != false;
                self.references(path, position, declared)
            }
            "documentHighlight" => self.highlights(path, position),
            "hover" => self.hover(path, position)?,
            "documentSymbol" => outline::symbols_of(files, editor, path),
            "foldingRange" => outline::folds(editor, path),
            "selectionRange" => outline::selections(editor, path, &parameters["positions"]),
            "semanticTokens/full" => tokens::words(files, editor, path),
            "signatureHelp" => signature::signature(files, editor, path, position),
            "inlayHint" => {
                if path.extension().is_some_and(|ending| ending == "ddsl") {
                    self.know_networks()?;
                }
                hints::hints(&self.files, &self.networks, &self.editor, path, range)
            }
            "codeLens" => hints::lenses(files, editor, path),
            "rangeFormatting" => layout::format_range(editor, path, range),
            "onTypeFormatting" => layout::format_behind(editor, path, position),
            "prepareRename" => return Ok(self.renamable(path, position)),
            "rename" => return self.rename(path, position, &parameters["newName"]),
            _ => Value::Null,
        }))
    }
}
