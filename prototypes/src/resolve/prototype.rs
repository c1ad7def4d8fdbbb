//! Resolves prototypes.

mod composition;
mod covariance;

use super::{Kind, Resolver};
use crate::ast::{Item, ItemKind, Operand, OperandKind, Representation};
use crate::fields::Fields;
use crate::geometry::{Coordinate, coordinate, semantic};
use crate::interface::Interface;
use crate::maps::{Side, pairs, pairs_with};
use crate::model::{Content, Datum, Part, Prototype};
use crate::roles::{Roles, role};
use covariance::covariances;
use rc_diagnostics::{Diagnostic, Span};
use rc_quantity::Unit;
use rc_syntax::Name;
use rc_vocabulary::Primitive;
use std::collections::HashMap;

/// All fields of a prototype.
pub const FIELDS: [&str; 15] = [
    "semantic",
    "coord",
    "algebraic",
    "ddr",
    "dr",
    "units",
    "composes",
    "usingddr",
    "axes",
    "body",
    "frames",
    "sequence",
    "covariance",
    "tolerance",
    "loss",
];

/// The meanings with the rotation of a body.
const BODIES: [&str; 4] = ["Orientation", "Pose", "PairPose", "KinematicState"];

/// Known coordinates.
enum Coordinates {
    /// Those of `geometry`.
    Geometry(Coordinate),
    /// Those of a domain of the file.
    Own,
}

impl<'f> Resolver<'f> {
    pub(super) fn prototype(&mut self, item: &'f Item) {
        let ItemKind::Prototype(name, domain, fields) = &item.kind else {
            return;
        };
        if self.declared.get(&(Kind::Prototype, &name.text)) != Some(&name.span) {
            return;
        }
        let in_geometry = domain.text == "geometry";
        if !in_geometry && !self.is_known(Kind::Domain, &domain.text, domain.span) {
            return;
        }
        let fields = Fields::new(&name.text, name.span, fields, &FIELDS, &mut self.found);
        fields.must_have("semantic", &mut self.found);
        let meaning = fields.name("semantic", &mut self.found);
        let Some(meaning) = meaning.filter(|meaning| self.is_meaning(domain, meaning)) else {
            return;
        };
        let content = if fields.has("composes") {
            for field in ["coord", "algebraic", "units", "sequence"] {
                if fields.has(field) {
                    let message = format!("`{}` composes others; it has no `{field}`", name.text);
                    self.error("conflicting-fields", name.span, message);
                }
            }
            self.parts(&fields, name, domain, meaning)
        } else {
            self.values(&fields, name, domain, meaning)
        };
        let Some((content, interface)) = content else {
            return;
        };
        let composite = match (&content, &interface) {
            (Content::Parts(_), Some(of)) => of.name(),
            _ => None,
        };
        if in_geometry {
            self.fitting(&fields, &meaning.text());
        }
        let [axes, body] = ["axes", "body"].map(|field| {
            let axes = fields.name(field, &mut self.found);
            axes.filter(|axes| self.is_known(Kind::Axes, &axes.text(), axes.span))
        });
        self.fitting_body(&fields, axes, body);
        let tolerance = fields.number("tolerance", &mut self.found);
        if tolerance.is_some_and(|tolerance| tolerance >= 1.0) {
            let message = format!("`tolerance` of `{}` must be below 1", name.text);
            self.error("wrong-value", name.span, message);
        }
        let loss = fields.number("loss", &mut self.found);
        let sequence = fields.member("sequence", &mut self.found);
        if meaning.text() == "PointSet" && in_geometry {
            fields.must_have("sequence", &mut self.found);
        }
        let prototype = Prototype {
            name: name.text.clone(),
            span: name.span,
            domain: domain.text.clone(),
            semantic: meaning.text(),
            composite,
            content,
            axes: axes.map(Operand::text),
            body: body.map(Operand::text),
            frames: self.frames(&fields),
            sequence: sequence.map(|(path, _)| path.to_owned()),
            covariance: self.covariance(
                &fields,
                in_geometry.then_some(&meaning.text()),
                interface.as_ref(),
            ),
            tolerance,
            loss,
        };
        self.library.prototypes.push(prototype);
    }

    /// Reports fields that say nothing about a meaning of `geometry`.
    fn fitting(&mut self, fields: &Fields<'f>, meaning: &str) {
        for field in ["axes", "body", "sequence", "tolerance", "covariance"] {
            let fits = match field {
                "body" => BODIES.contains(&meaning),
                "axes" => !["JointState", "Range", "TimeStamp"].contains(&meaning),
                "sequence" => meaning != "TimeStamp",
                "tolerance" => ["Orientation", "Pose"].contains(&meaning),
                _ => covariances(meaning).is_some(),
            };
            if let Some(at) = fields.at(field).filter(|_| !fits) {
                let message = format!("{meaning} has no `{field}`");
                self.error("conflicting-fields", at, message);
            }
        }
    }

    /// Reports axes of a body without those around it, or of the other handedness.
    fn fitting_body(
        &mut self,
        fields: &Fields<'f>,
        axes: Option<&Operand>,
        body: Option<&Operand>,
    ) {
        if fields.has("body") {
            fields.must_have("axes", &mut self.found);
        }
        let Some((axes, body)) = axes.zip(body) else {
            return;
        };
        let hand = |of: &Operand| {
            let mut all = self.library.axes.iter();
            let found = all.find(|axes| axes.name == of.text());
            found.map(|axes| axes.is_right_handed)
        };
        if hand(axes) != hand(body) {
            let message = "one of `axes` and `body` is right-handed, and the other one left-handed";
            self.error("conflicting-fields", body.span, message);
        }
    }

    /// Whether the domain has a meaning. Reports an unknown one.
    fn is_meaning(&mut self, domain: &Name, meaning: &Operand) -> bool {
        let name = meaning.text();
        let own = self.library.domains.iter().find(|d| d.name == domain.text);
        let known: Vec<&str> = match own {
            Some(own) => own.semantics.iter().map(String::as_str).collect(),
            None => crate::GEOMETRY
                .iter()
                .map(|semantic| semantic.name)
                .collect(),
        };
        if known.contains(&name.as_str()) {
            return true;
        }
        let message = format!("`{}` has no meaning `{name}`", domain.text);
        let diagnostic = Diagnostic::error("unknown-semantic", meaning.span, message);
        self.found.push(diagnostic.suggest(&name, known));
        false
    }

    /// The coordinates. Reports an unknown name.
    fn coordinates(
        &mut self,
        domain: &Name,
        meaning: &str,
        wanted: &Operand,
    ) -> Option<Coordinates> {
        let name = wanted.text();
        let own = self.library.domains.iter().find(|d| d.name == domain.text);
        let known: Vec<&str> = match own {
            Some(own) if own.coordinates.contains(&name) => return Some(Coordinates::Own),
            Some(own) => own.coordinates.iter().map(String::as_str).collect(),
            None => {
                let of = semantic(meaning)?;
                if of.has(&name) {
                    return coordinate(&name).map(Coordinates::Geometry);
                }
                // Two of the Euler orders show what their names look like.
                let euler = ["euler_zyx_moving", "euler_zyz_fixed"];
                let euler = euler.into_iter().filter(|name| of.has(name));
                of.coordinates.iter().copied().chain(euler).collect()
            }
        };
        let message = format!("{meaning} has no coordinates `{name}`");
        let diagnostic = Diagnostic::error("unknown-coordinate", wanted.span, message);
        self.found.push(diagnostic.suggest(&name, known));
        None
    }

    fn values(
        &mut self,
        fields: &Fields<'f>,
        name: &Name,
        domain: &Name,
        meaning: &Operand,
    ) -> Option<(Content, Option<Interface<'f>>)> {
        for field in ["coord", "algebraic", "ddr", "dr"] {
            fields.must_have(field, &mut self.found);
        }
        let wanted = fields.name("coord", &mut self.found);
        let coordinates =
            wanted.map(|wanted| (wanted, self.coordinates(domain, &meaning.text(), wanted)));
        let algebraic = fields.name("algebraic", &mut self.found)?;
        let symbols = self.symbols_of(&algebraic.text(), algebraic.span)?;
        let (wanted, coordinates) = coordinates?;
        let coordinates = match coordinates? {
            Coordinates::Geometry(of) => Some(of),
            Coordinates::Own => None,
        };
        let kind = algebraic.text();
        let meaning = meaning.text();
        let mut places = None;
        if let Some(of) = &coordinates {
            let roles = Roles {
                semantic: &meaning,
                coordinate: of,
                algebraic: &kind,
                symbols: &symbols,
            };
            if !roles.has_room() {
                let message = format!(
                    "`{}` has {} values, `{kind}` has {}",
                    wanted.text(),
                    of.values.len(),
                    symbols.len()
                );
                self.error("wrong-count", algebraic.span, message);
                return None;
            }
            match roles.places(&self.library.aliases) {
                Ok(found) => places = Some(found),
                Err(must) => {
                    let message = format!("an abstract type for `{}` has {must}", wanted.text());
                    self.error("wrong-algebraic", algebraic.span, message);
                    return None;
                }
            }
        }
        let ddr = self.ddr(fields)?;
        let map = fields.map("dr", &mut self.found)?;
        let (left, right) = (Side::any("the type"), Side::all(&kind, &symbols));
        let pairs = pairs_with(map, (&left, &right), true, &mut self.found);
        let whole = self.interface(fields, ddr, domain, &meaning);
        let elements = match (&whole, fields.member("sequence", &mut self.found)) {
            (Some(of), Some((path, at))) => of.elements(path, at, &mut self.found),
            _ => None,
        };
        let interface = elements.as_ref().or(whole.as_ref());
        let mut by_symbol: HashMap<String, (Datum, Span)> = HashMap::new();
        for (member, symbol, is_opposite) in pairs {
            let path = member.text();
            let (unit, number) = match interface {
                Some(of) => of.number(&path, member.span, &mut self.found),
                None => (None, of_c(&ddr.language.text, &ddr.model.text)),
            };
            let datum = Datum {
                symbol: symbol.text(),
                role: symbol.text(),
                member: path,
                unit,
                number,
                is_opposite,
            };
            by_symbol.insert(symbol.text(), (datum, member.span));
        }
        self.add_units(fields, &kind, &mut by_symbol);
        let unit = semantic(&meaning).map_or("1", |semantic| semantic.unit);
        let mut data = Vec::new();
        for (at, symbol) in symbols.iter().enumerate() {
            let Some((mut datum, span)) = by_symbol.remove(symbol) else {
                continue;
            };
            let place = places.as_ref().and_then(|places| places.get(at));
            if let Some((of, place)) = coordinates.as_ref().zip(place) {
                datum.role = role(of, *place);
                if let Some((_, wanted)) = of.values.get(*place) {
                    self.dimension(&datum, span, wanted.unwrap_or(unit));
                }
            }
            data.push(datum);
        }
        if data.is_empty() {
            self.error("missing-symbol", name.span, "the prototype has no values");
        }
        let content = Content::Values {
            coordinate: wanted.text(),
            algebraic: kind,
            language: ddr.language.text.clone(),
            ty: ddr.model.text.clone(),
            data,
        };
        Some((content, whole))
    }

    /// The field `ddr`: a type, or the name of one.
    fn ddr(&mut self, fields: &Fields<'f>) -> Option<&'f Representation> {
        match fields.representation("ddr", &mut self.found)? {
            Ok(of) => Some(of),
            Err(of) => {
                if !self.is_known(Kind::Ddr, &of.text(), of.span) {
                    return None;
                }
                self.ddrs.get(of.text().as_str()).copied()
            }
        }
    }

    /// The type of an interface. Reports fields that name members which it does not have.
    fn interface(
        &mut self,
        fields: &Fields<'f>,
        ddr: &Representation,
        domain: &Name,
        meaning: &str,
    ) -> Option<Interface<'f>> {
        if ddr.language.text != "IDSL" {
            return None;
        }
        let ty = &ddr.model;
        let interface = Interface::find(self.idsl, &ty.text, ty.span, &mut self.found);
        self.members(fields, interface.as_ref());
        let numbers = covariances(meaning).filter(|_| domain.text == "geometry");
        if let (Some(of), Some(numbers)) = (&interface, numbers) {
            self.covariance_length(fields, of, meaning, numbers);
        }
        interface
    }

    /// Adds the units of the field `units`.
    fn add_units(
        &mut self,
        fields: &Fields<'f>,
        algebraic: &str,
        data: &mut HashMap<String, (Datum, Span)>,
    ) {
        let Some(name) = fields.name("units", &mut self.found) else {
            return;
        };
        if !self.is_known(Kind::Units, &name.text(), name.span) {
            return;
        }
        let Some(units) = self.units.get(name.text().as_str()) else {
            return;
        };
        if units.of != algebraic {
            let message = format!("`{}` are units of `{}`", name.text(), units.of);
            self.error("wrong-units", name.span, message);
            return;
        }
        let mut differing = Vec::new();
        for (symbol, unit) in &units.by_symbol {
            let Some((datum, at)) = data.get_mut(symbol) else {
                continue;
            };
            match &datum.unit {
                Some(own) if own != unit => differing.push((*at, own.clone(), unit.clone())),
                _ => datum.unit = Some(unit.clone()),
            }
        }
        differing.sort_by_key(|(at, ..)| at.start);
        for (at, own, unit) in differing {
            let message = format!("the member has the unit {own}, the prototype says {unit}");
            self.error("wrong-units", at, message);
        }
    }

    /// Reports a unit of another dimension.
    fn dimension(&mut self, datum: &Datum, at: Span, wanted: &str) {
        let Some(unit) = &datum.unit else { return };
        let (Ok(own), Ok(of)) = (Unit::parse(unit), Unit::parse(wanted)) else {
            return;
        };
        if own.conversion_to(&of).is_none() {
            let message = format!(
                "`{}` is in {unit}, which is not a unit of {wanted}",
                datum.member
            );
            self.error("wrong-units", at, message);
        }
    }

    /// Reports members of `frames` and `covariance` that the type does not have.
    fn members(&mut self, fields: &Fields<'f>, interface: Option<&Interface<'f>>) {
        let Some(interface) = interface else { return };
        for field in ["frames", "covariance"] {
            let Some(map) = fields.map(field, &mut self.found) else {
                continue;
            };
            for entry in &map.entries {
                let right = entry.right.as_ref().map(|(_, right)| right);
                for operand in [Some(&entry.left), right].into_iter().flatten() {
                    if let OperandKind::Member(path) = &operand.kind {
                        interface.path(path, operand.span, &mut self.found);
                    }
                }
            }
        }
    }

    fn parts(
        &mut self,
        fields: &Fields<'f>,
        name: &'f Name,
        domain: &Name,
        meaning: &Operand,
    ) -> Option<(Content, Option<Interface<'f>>)> {
        let map = fields.map("composes", &mut self.found)?;
        let kind = meaning.text();
        let geometry = (domain.text == "geometry")
            .then(|| semantic(&kind))
            .flatten();
        let known: Vec<String> = if let Some(of) = geometry {
            let names = of.parts.iter().map(|(name, _)| (*name).to_owned());
            names.collect()
        } else {
            let domains = &self.library.domains;
            let own = domains.iter().find(|own| own.name == domain.text);
            own.map(|own| own.semantics.clone()).unwrap_or_default()
        };
        if geometry.is_some() && known.is_empty() {
            let message = format!("{kind} has no parts");
            self.error("unknown-part", meaning.span, message);
            return None;
        }
        let all = Side::all(&kind, &known);
        let left = if geometry.is_some() {
            all
        } else {
            Side::some(&kind, &known)
        };
        let right = Side::free("a prototype");
        let composed = pairs(map, &left, &right, &mut self.found);
        let mut parts = Vec::new();
        for (part, prototype) in composed {
            let name = prototype.text();
            if !self.is_known(Kind::Prototype, &name, prototype.span) {
                continue;
            }
            let wanted = geometry.and_then(|of| of.parts.iter().find(|(p, _)| *p == part.text()));
            let wanted = wanted.map_or(part.text(), |(_, wanted)| (*wanted).to_owned());
            self.is_part(&name, prototype.span, domain, &wanted);
            parts.push(Part {
                name: part.text(),
                prototype: name,
                member: None,
            });
        }
        if let Some(map) = fields.map("dr", &mut self.found) {
            let names: Vec<String> = parts.iter().map(|part| part.name.clone()).collect();
            let (left, right) = (Side::any("the type"), Side::all(&kind, &names));
            for (member, part) in pairs(map, &left, &right, &mut self.found) {
                let part = part.text();
                if let Some(own) = parts.iter_mut().find(|own| own.name == part) {
                    own.member = Some(member.text());
                }
            }
        }
        if let Some(map) = fields.map("usingddr", &mut self.found) {
            let known = ["mid", "mmid"].map(str::to_owned);
            let (left, right) = (Side::all("usingddr", &known), Side::free("a name"));
            pairs(map, &left, &right, &mut self.found);
        }
        if !fields.has("ddr") {
            return Some((Content::Parts(parts), None));
        }
        let ddr = self.ddr(fields)?;
        let interface = self.interface(fields, ddr, domain, &kind);
        if !fields.has("dr") {
            // The numbers of the parts are members of the type itself.
            parts
                .iter_mut()
                .for_each(|part| part.member = Some(String::new()));
        }
        if let Some(of) = &interface {
            for part in &parts {
                let Some(member) = &part.member else { continue };
                let ty = match member.as_str() {
                    "" => of.name(),
                    member => of.type_at(member, name.span, &mut self.found),
                };
                let places = self.held.entry(&name.text).or_default();
                places.push((part.prototype.clone(), member.clone(), ty));
            }
        }
        Some((Content::Parts(parts), interface))
    }

    /// Reports a prototype whose meaning is not that of the part.
    fn is_part(&mut self, prototype: &str, at: Span, domain: &Name, wanted: &str) {
        let Some(meaning) = self.prototypes.get(prototype) else {
            return;
        };
        let semantic = meaning.semantic.map(Operand::text).unwrap_or_default();
        if meaning.domain != domain.text || semantic != wanted {
            let message = format!("`{prototype}` is {semantic}, the part is {wanted}");
            self.error("semantic-mismatch", at, message);
        }
    }

    fn frames(&mut self, fields: &Fields<'f>) -> Vec<(String, String)> {
        let Some(map) = fields.map("frames", &mut self.found) else {
            return Vec::new();
        };
        let known = ["of", "with_respect_to", "stamp"].map(str::to_owned);
        let (left, right) = (Side::some("frames", &known), Side::free("a frame"));
        let pairs = pairs(map, &left, &right, &mut self.found);
        pairs
            .iter()
            .map(|(name, of)| (name.text(), of.text()))
            .collect()
    }
}

/// The numbers of a type of C, such as `float[3]`.
fn of_c(language: &str, ty: &str) -> Option<Primitive> {
    let element = ty.split('[').next().unwrap_or_default().trim();
    let number = match element {
        "int" => Primitive::I32,
        c => Primitive::ALL
            .into_iter()
            .find(|one| one.c() == c)?
            .number()?,
    };
    (language == "c99").then_some(number)
}
