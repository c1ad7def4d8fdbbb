//! What a host says about its processor, and where its programs are built.

use crate::ast;
use crate::fields::whole_number;
use crate::model::{BuildPlace, HostBuild, Processor};
use rc_diagnostics::{Diagnostic, Diagnostics, Span};
use rc_syntax::Name;
use std::ops::RangeInclusive;

/// The valid values of `jobs`.
const JOBS: RangeInclusive<i64> = 1..=1024;
/// The valid values of `nice`, see nice(1). A lower one needs a right that users rarely have.
const NICE: RangeInclusive<i64> = 0..=19;

/// The words after `build`.
const PLACES: [(&str, BuildPlace); 2] = [("here", BuildPlace::Here), ("there", BuildPlace::There)];

pub(crate) fn arch(name: &Name, found: &mut Diagnostics) -> Option<(Processor, Span)> {
    let known = Processor::from_word(&name.text.to_ascii_lowercase());
    if known.is_none() {
        let message = format!("unknown processor architecture `{}`", name.text);
        let error = Diagnostic::error("unknown-arch", name.span, message);
        found.push(match Processor::from_machine(&name.text) {
            Some(meant) => error.help(format!("did you mean `{meant}`?")),
            None => error.suggest(&name.text, Processor::words()),
        });
    }
    known.map(|processor| (processor, name.span))
}

pub(crate) fn build(tree: &ast::HostBuild, found: &mut Diagnostics) -> HostBuild {
    let word = &tree.place;
    let mut places = PLACES.iter();
    let place = places.find(|(text, _)| word.text.eq_ignore_ascii_case(text));
    if place.is_none() {
        let message = format!("programs are built `here` or `there`, not `{}`", word.text);
        let error = Diagnostic::error("unknown-build-place", word.span, message);
        found.push(error.suggest(&word.text, PLACES.map(|(text, _)| text)));
    }
    let jobs = tree.jobs.as_ref();
    let jobs = jobs.and_then(|jobs| whole_number(jobs, "a number of jobs", &JOBS, found));
    let nice = tree.nice.as_ref();
    let nice = nice.and_then(|nice| whole_number(nice, "a niceness", &NICE, found));
    HostBuild {
        place: place.map(|(_, place)| *place),
        jobs: jobs.and_then(|jobs| u16::try_from(jobs).ok()),
        nice: nice
            .and_then(|nice| u8::try_from(nice).ok())
            .unwrap_or_default(),
    }
}
