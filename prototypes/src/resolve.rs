//! Resolves the names of all files of a file.

mod prototype;

pub use prototype::FIELDS;

use crate::ast::{File, Item, ItemKind, Map, Operand, Representation, Shape};
use crate::fields::Fields;
use crate::geometry::semantic;
use crate::imports::Imports;
use crate::maps::{Side, pairs};
use crate::model::{Algebraic, Alias, Content, Conversion, Domain, Library, NamedAxes, View};
use crate::roles::part_of_matrix;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_idsl::Session;
use rc_quantity::Axes;
use rc_syntax::{Loader, Name, unknown_unit};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// The most values of an abstract type.
const MOST_VALUES: u32 = 1024;

/// Loads `.dproto` texts with their imports. Use the library only if no diagnostic is an error.
pub fn load(
    sources: &mut SourceMap,
    loader: &dyn Loader,
    texts: &[SourceId],
) -> (Library, Diagnostics) {
    let mut imports = Imports::new(Session::new(sources, loader));
    texts.iter().for_each(|text| imports.root(*text));
    resolved(imports)
}

/// Loads the `.dproto` files that other files import: the importing file, and the import. Use the
/// library only if no diagnostic is an error.
pub fn import<'w>(
    sources: &mut SourceMap,
    loader: &dyn Loader,
    wanted: impl IntoIterator<Item = (&'w Path, &'w Name)>,
) -> (Library, Diagnostics) {
    let mut imports = Imports::new(Session::new(sources, loader));
    for (from, file) in wanted {
        imports.import(from, file);
    }
    resolved(imports)
}

fn resolved(imports: Imports<'_>) -> (Library, Diagnostics) {
    let files = imports.files;
    let mut resolver = Resolver {
        idsl: &imports.session.library,
        found: imports.session.found,
        library: Library::default(),
        declared: HashMap::new(),
        ddrs: BTreeMap::new(),
        units: BTreeMap::new(),
        prototypes: BTreeMap::new(),
        held: BTreeMap::new(),
    };
    let items = || files.iter().flat_map(|file: &File| &file.items);
    items().for_each(|item| resolver.declare(item));
    items().for_each(|item| resolver.units_of(item));
    items().for_each(|item| resolver.alias(item));
    items().for_each(|item| resolver.prototype(item));
    resolver.compose();
    items().for_each(|item| resolver.relate(item));
    (resolver.library, resolver.found)
}

/// The target of the name of a declaration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Kind {
    Axes,
    Algebraic,
    Ddr,
    Units,
    Domain,
    Function,
    Prototype,
}

/// `units NAME :: qudt, ALGEBRAIC { … }`
struct Units<'f> {
    of: &'f str,
    by_symbol: HashMap<String, String>,
}

struct Resolver<'f> {
    idsl: &'f rc_idsl::Library,
    found: Diagnostics,
    library: Library,
    declared: HashMap<(Kind, &'f str), Span>,
    ddrs: BTreeMap<&'f str, &'f Representation>,
    units: BTreeMap<&'f str, Units<'f>>,
    /// The meaning of each prototype.
    prototypes: BTreeMap<&'f str, Meaning<'f>>,
    /// The parts of each composite in a type of an interface: prototype, member, and its type.
    held: BTreeMap<&'f str, Vec<(String, String, Option<String>)>>,
}

/// The domain of a prototype, and its meaning there.
struct Meaning<'f> {
    domain: &'f str,
    semantic: Option<&'f Operand>,
}

/// The names of the values of a shape. The error says what is wrong.
fn symbols(shape: &Shape) -> Result<Vec<String>, (Span, String)> {
    let number = |name: &Name| {
        let number = name.text.parse::<u32>().ok();
        let number = number.filter(|number| (1..=MOST_VALUES).contains(number));
        let message = format!("expected a number from 1 to {MOST_VALUES}");
        number.ok_or((name.span, message))
    };
    match shape {
        Shape::Scalar(names) => Ok(names.iter().map(|name| name.text.clone()).collect()),
        Shape::Vector(length) => Ok((0..number(length)?).map(|at| at.to_string()).collect()),
        Shape::Matrix(rows, columns) => {
            let (count, width) = (number(rows)?, number(columns)?);
            if count * width > MOST_VALUES {
                let message = format!("a matrix has at most {MOST_VALUES} numbers");
                return Err((rows.span.to(columns.span), message));
            }
            let all = (0..count).flat_map(|row| (0..width).map(move |column| (row, column)));
            Ok(all
                .map(|(row, column)| format!("{{{row},{column}}}"))
                .collect())
        }
    }
}

impl<'f> Resolver<'f> {
    fn error(&mut self, code: &'static str, span: Span, message: impl Into<String>) {
        self.found.push(Diagnostic::error(code, span, message));
    }

    /// Whether a name is new among those of its kind.
    fn is_new(&mut self, kind: Kind, name: &'f Name) -> bool {
        if let Some(first) = self.declared.get(&(kind, &name.text)) {
            let message = format!("`{}` is declared twice", name.text);
            let diagnostic = Diagnostic::error("duplicate-name", name.span, message);
            self.found
                .push(diagnostic.label(*first, "first declared here"));
            return false;
        }
        self.declared.insert((kind, &name.text), name.span);
        true
    }

    /// Whether a name is declared. Reports an unknown one.
    fn is_known(&mut self, kind: Kind, name: &str, at: Span) -> bool {
        if self.declared.contains_key(&(kind, name)) {
            return true;
        }
        let (code, what) = match kind {
            Kind::Axes => ("unknown-axes", "axes"),
            Kind::Algebraic => ("unknown-algebraic", "abstract type"),
            Kind::Ddr => ("unknown-type", "type"),
            Kind::Units => ("unknown-units", "units"),
            Kind::Domain => ("unknown-domain", "domain"),
            Kind::Function => ("unknown-function", "function"),
            Kind::Prototype => ("unknown-prototype", "prototype"),
        };
        let mut known: Vec<&str> = self
            .declared
            .keys()
            .filter(|(of, _)| *of == kind)
            .map(|(_, name)| *name)
            .collect();
        if kind == Kind::Domain {
            known.push("geometry");
        }
        known.sort_unstable();
        let diagnostic = Diagnostic::error(code, at, format!("unknown {what} `{name}`"));
        self.found.push(diagnostic.suggest(name, known));
        false
    }

    /// Declares all but prototypes and relations.
    fn declare(&mut self, item: &'f Item) {
        match &item.kind {
            ItemKind::Axes(name, directions) if self.is_new(Kind::Axes, name) => {
                let words: Vec<&str> = directions.iter().map(|d| d.text.as_str()).collect();
                let directions = words.join(", ");
                match directions.parse::<Axes>() {
                    Ok(axes) => self.library.axes.push(NamedAxes {
                        name: name.text.clone(),
                        directions,
                        is_right_handed: axes.is_right_handed(),
                    }),
                    Err(error) => self.error("bad-axes", item.span, error.to_string()),
                }
            }
            ItemKind::Algebraic(name, shape) if self.is_new(Kind::Algebraic, name) => {
                if let Shape::Scalar(names) = shape {
                    let mut first: HashMap<&str, Span> = HashMap::new();
                    for symbol in names {
                        let at = *first.entry(&symbol.text).or_insert(symbol.span);
                        if at != symbol.span {
                            let message = format!("`{}` is given twice", symbol.text);
                            self.error("repeated-key", symbol.span, message);
                        }
                    }
                }
                match symbols(shape) {
                    Ok(symbols) => self.library.algebraics.push(Algebraic {
                        name: name.text.clone(),
                        symbols,
                    }),
                    Err((span, message)) => self.error("bad-length", span, message),
                }
            }
            ItemKind::Ddr(name, of) if self.is_new(Kind::Ddr, name) => {
                self.ddrs.insert(&name.text, of);
            }
            ItemKind::Domain(name, fields) if self.is_new(Kind::Domain, name) => {
                if name.text == "geometry" {
                    let message = "the domain `geometry` comes with the tools";
                    self.error("reserved-name", name.span, message);
                    return;
                }
                let known = ["semantic", "coord"];
                let fields = Fields::new(&name.text, name.span, fields, &known, &mut self.found);
                known
                    .iter()
                    .for_each(|field| fields.must_have(field, &mut self.found));
                let semantics = fields.names("semantic", &mut self.found);
                self.library.domains.push(Domain {
                    name: name.text.clone(),
                    semantics,
                    coordinates: fields.names("coord", &mut self.found),
                });
            }
            ItemKind::Prototype(name, domain, fields) if self.is_new(Kind::Prototype, name) => {
                let mut ignored = Diagnostics::new();
                let all = Fields::new(&name.text, name.span, fields, &["semantic"], &mut ignored);
                let meaning = Meaning {
                    domain: &domain.text,
                    semantic: all.name("semantic", &mut ignored),
                };
                self.prototypes.insert(&name.text, meaning);
            }
            ItemKind::Function(name, ..) => {
                self.is_new(Kind::Function, name);
            }
            _ => {}
        }
    }

    /// The values of an abstract type. Reports an unknown one.
    fn symbols_of(&mut self, name: &str, at: Span) -> Option<Vec<String>> {
        if !self.is_known(Kind::Algebraic, name, at) {
            return None;
        }
        self.library.algebraic(name).map(|of| of.symbols.clone())
    }

    fn units_of(&mut self, item: &'f Item) {
        let ItemKind::Units(name, vocabulary, of, map) = &item.kind else {
            return;
        };
        if !self.is_new(Kind::Units, name) {
            return;
        }
        if vocabulary.text != "qudt" {
            let message = format!("unknown vocabulary of units `{}`", vocabulary.text);
            let diagnostic = Diagnostic::error("unknown-vocabulary", vocabulary.span, message);
            self.found.push(diagnostic.help("write `qudt`"));
        }
        let Some(symbols) = self.symbols_of(&of.text, of.span) else {
            return;
        };
        let (left, right) = (Side::some(&of.text, &symbols), Side::free("a unit"));
        let pairs = pairs(map, &left, &right, &mut self.found);
        let mut by_symbol = HashMap::new();
        for (symbol, unit) in pairs {
            self.found.extend(unknown_unit(&unit.text(), unit.span));
            by_symbol.insert(symbol.text(), unit.text());
        }
        let of = &of.text;
        self.units.insert(&name.text, Units { of, by_symbol });
    }

    /// Declares views and conversions.
    fn relate(&mut self, item: &'f Item) {
        match &item.kind {
            ItemKind::View(of, part, target, map) => self.view(of, part, target, map),
            ItemKind::Conversion(from, to, by) => {
                let from_known = self.is_known(Kind::Prototype, &from.text, from.span);
                if !self.is_known(Kind::Prototype, &to.text, to.span) || !from_known {
                    return;
                }
                self.same_meaning(&from.text, &to.text, to.span);
                self.library.conversions.push(Conversion {
                    from: from.text.clone(),
                    to: to.text.clone(),
                    function: by.text.clone(),
                });
            }
            ItemKind::Function(name, _, fields) => {
                let known = ["library", "fname", "args"];
                let fields = Fields::new(&name.text, name.span, fields, &known, &mut self.found);
                let Some(map) = fields.map("args", &mut self.found) else {
                    return;
                };
                for entry in &map.entries {
                    if let Some((_, prototype)) = &entry.right {
                        self.is_known(Kind::Prototype, &prototype.text(), prototype.span);
                    }
                }
            }
            _ => {}
        }
    }

    /// Reports two prototypes with different meanings.
    fn same_meaning(&mut self, from: &str, to: &str, at: Span) {
        let of = |name: &str| {
            let prototype = self.library.prototype(name)?;
            Some((prototype.domain.clone(), prototype.semantic.clone()))
        };
        if let (Some(one), Some(other)) = (of(from), of(to))
            && one != other
        {
            let message = format!("`{from}` is {}, `{to}` is {}", one.1, other.1);
            self.error("semantic-mismatch", at, message);
        }
    }

    fn alias(&mut self, item: &'f Item) {
        let ItemKind::Alias(left, right, map) = &item.kind else {
            return;
        };
        let one = self.symbols_of(&left.text, left.span);
        let other = self.symbols_of(&right.text, right.span);
        let (Some(one), Some(other)) = (one, other) else {
            return;
        };
        let (left_side, right_side) = (Side::all(&left.text, &one), Side::all(&right.text, &other));
        let pairs = pairs(map, &left_side, &right_side, &mut self.found);
        self.library.aliases.push(Alias {
            left: left.text.clone(),
            right: right.text.clone(),
            pairs: pairs.iter().map(|(a, b)| (a.text(), b.text())).collect(),
        });
    }

    /// The values of a prototype that is not a composite. Reports a composite.
    fn values_of(&mut self, name: &Name) -> Option<(String, Vec<String>)> {
        let prototype = self.library.prototype(&name.text)?;
        let Content::Values { algebraic, .. } = &prototype.content else {
            let message = format!("`{}` composes others; a view needs values", name.text);
            self.error("wrong-type", name.span, message);
            return None;
        };
        let symbols = &self.library.algebraic(algebraic)?.symbols;
        Some((algebraic.clone(), symbols.clone()))
    }

    fn view(&mut self, of: &Name, part: &Name, target: &Name, map: &Map) {
        let is_known = self.is_known(Kind::Prototype, &of.text, of.span);
        if !self.is_known(Kind::Prototype, &target.text, target.span) || !is_known {
            return;
        }
        let (Some((whole, one)), Some((name, other))) =
            (self.values_of(of), self.values_of(target))
        else {
            return;
        };
        let semantic_of = |library: &Library, name: &str| {
            let semantic = library.prototype(name).map(|p| p.semantic.clone());
            semantic.unwrap_or_default()
        };
        let (meaning, wanted) = (
            semantic_of(&self.library, &of.text),
            semantic_of(&self.library, &target.text),
        );
        let whole_of = self.library.prototype(&of.text);
        let in_geometry = whole_of.is_some_and(|whole| whole.domain == "geometry");
        let parts = semantic(&meaning).filter(|_| in_geometry);
        let parts = parts.map_or(&[][..], |known| known.parts);
        let known = parts.iter().find(|(known, _)| *known == part.text);
        match known {
            None => {
                let message = format!("{meaning} has no part `{}`", part.text);
                let known = parts.iter().map(|(known, _)| *known);
                let diagnostic = Diagnostic::error("unknown-part", part.span, message);
                self.found.push(diagnostic.suggest(&part.text, known));
            }
            Some((_, kind)) if *kind != wanted => {
                let message = format!("`{}` is {wanted}, the part is {kind}", target.text);
                self.error("semantic-mismatch", target.span, message);
            }
            Some(_) => {}
        }
        let (left, right) = (Side::some(&whole, &one), Side::all(&name, &other));
        let pairs = pairs(map, &left, &right, &mut self.found);
        if known.is_some_and(|(_, kind)| *kind == wanted) {
            self.view_cells(of, part, target, &pairs);
        }
        self.library.views.push(View {
            of: of.text.clone(),
            part: part.text.clone(),
            target: target.text.clone(),
            pairs: pairs.iter().map(|(a, b)| (a.text(), b.text())).collect(),
        });
    }

    /// Reports values of a view that are not where the convention of the matrix has them.
    fn view_cells(
        &mut self,
        of: &Name,
        part: &Name,
        target: &Name,
        pairs: &[(&Operand, &Operand)],
    ) {
        let library = &self.library;
        let content = |name: &str| match &library.prototype(name)?.content {
            Content::Values {
                coordinate, data, ..
            } => Some((coordinate, data)),
            Content::Parts(_) => None,
        };
        let (Some((whole, cells)), Some((coordinate, values))) =
            (content(&of.text), content(&target.text))
        else {
            return;
        };
        let Some(places) = part_of_matrix(whole, &part.text, coordinate) else {
            let message = format!("the {} in {whole} is not {coordinate}", part.text);
            let diagnostic = Diagnostic::error("wrong-view", target.span, message);
            self.found.push(diagnostic.help(
                "a homogeneous matrix holds a position as `cartesian`, an orientation as `rot_matrix`",
            ));
            return;
        };
        let names = crate::coordinate(coordinate).map_or(&[][..], |of| of.values);
        let mut wrong = Vec::new();
        for (cell, value) in pairs {
            let value = value.text();
            let role = values.iter().find(|own| own.symbol == value);
            let place = role.and_then(|own| {
                let by_name = names.iter().position(|(name, _)| *name == own.role);
                places.get(by_name.or_else(|| own.role.parse().ok())?)
            });
            let Some(place) = place.map(ToString::to_string) else {
                continue;
            };
            let right = cells.iter().find(|own| own.role == place);
            if let Some(right) = right.filter(|right| right.symbol != cell.text()) {
                let message = format!("in {whole}, `{value}` is `{}`", right.symbol);
                wrong.push(Diagnostic::error("wrong-view", cell.span, message));
            }
        }
        self.found.extend(wrong);
    }
}
