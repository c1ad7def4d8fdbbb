//! The names in files of parameters, and in configurations.

use super::{Collector, Kind, Symbol};
use rc_diagnostics::{SourceId, SourceMap};
use rc_pdsl::ast::{Expression, ExpressionKind, FlagKind, Item, Path};
use rc_syntax::Loader;
use rc_vocabulary::member;

impl Collector<'_> {
    pub(super) fn parameters(
        &mut self,
        sources: &SourceMap,
        source: SourceId,
        loader: &dyn Loader,
    ) {
        let (file, _) = rc_pdsl::parse(sources, source);
        for import in &file.imports {
            let found = loader.find(sources.path(source), &import.text, "pdsl");
            if let Ok(found) = found {
                let file = self.keys.of(&found.path);
                self.refers(import.span, Self::whole(file));
            }
        }
        if let Some(params) = &file.params {
            let name = &params.name;
            let symbols = vec![Self::whole(self.path.to_path_buf())];
            self.add(name.span, symbols, true);
            self.items(&params.items, "");
        }
    }

    /// Declarations of a block; `around` is the path of the block, with a dot.
    fn items(&mut self, items: &[Item], around: &str) {
        for item in items {
            if self.is_full() {
                return;
            }
            if let Some(name) = item.name() {
                self.declares(Kind::Parameter, name, format!("{around}{}", name.text));
            }
            let (name, inner) = match item {
                Item::Param(param) => {
                    for flag in &param.flags {
                        if let FlagKind::Element(_, of) = &flag.kind {
                            self.refers_from(of.span, around, &of.text);
                        }
                    }
                    continue;
                }
                Item::Group(group) => (&group.name, &group.items),
                Item::List(list) => (&list.name, &list.items),
                Item::Rule(rule) => {
                    self.expression(&rule.condition, around);
                    continue;
                }
                Item::Broken(..) => continue,
            };
            self.items(inner, &format!("{around}{}.", name.text));
        }
    }

    /// A parameter that a rule of the block `around` names: the innermost block that declares it.
    fn refers_from(&mut self, span: rc_diagnostics::Span, around: &str, path: &str) {
        if self.is_full() {
            return;
        }
        let ends = around.match_indices('.').map(|(at, _)| at + 1);
        let blocks = std::iter::once(0).chain(ends);
        let symbols = blocks.map(|end| {
            let name = format!("{}{path}", &around[..end]);
            self.symbol(Kind::Parameter, span.source, name)
        });
        let mut symbols: Vec<Symbol> = symbols.collect();
        symbols.reverse();
        self.add(span, symbols, false);
    }

    fn path(&mut self, path: &Path, around: &str) {
        for (at, name) in path.names.iter().enumerate() {
            if self.is_full() {
                return;
            }
            self.refers_from(name.span, around, &path.text(at + 1));
        }
    }

    fn expression(&mut self, expression: &Expression, around: &str) {
        match &expression.kind {
            ExpressionKind::Literal(_) => {}
            ExpressionKind::Path(path) | ExpressionKind::Call(_, path) => self.path(path, around),
            ExpressionKind::Negative(one) | ExpressionKind::Not(one) => {
                self.expression(one, around);
            }
            ExpressionKind::Sum(first, rest) => {
                self.expression(first, around);
                rest.iter()
                    .for_each(|(_, one)| self.expression(one, around));
            }
            ExpressionKind::Product(first, rest) => {
                self.expression(first, around);
                rest.iter()
                    .for_each(|(_, one)| self.expression(one, around));
            }
            ExpressionKind::Comparison(one, _, other) => {
                self.expression(one, around);
                self.expression(other, around);
            }
            ExpressionKind::All(all) | ExpressionKind::Any(all) => {
                all.iter().for_each(|one| self.expression(one, around));
            }
        }
    }

    /// The keys of a configuration: slots and parameters of its component.
    pub(super) fn configuration(
        &mut self,
        sources: &SourceMap,
        source: SourceId,
        cdsl: &std::path::Path,
    ) {
        self.names.component = Some(cdsl.to_path_buf());
        for (path, span) in rc_configuration::keys(sources, source) {
            let (kind, name) = match path.split_first() {
                Some((first, [slot, ..])) if first == "bindings" => {
                    let array = member::split(slot).map(|(array, _)| array);
                    (Kind::Slot, array.unwrap_or(slot).to_owned())
                }
                Some((first, rest)) if first == "parameters" && !rest.is_empty() => {
                    (Kind::OfComponent, rest.join("."))
                }
                _ => continue,
            };
            let file = cdsl.to_path_buf();
            self.refers(span, Symbol { file, kind, name });
        }
    }
}
