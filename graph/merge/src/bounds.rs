//! Limits that every replica keeps, and limits of a delta: a delta beyond them is refused as a
//! whole.

use crate::error::Error;
use crate::limits::{MOST_ATTRIBUTES, MOST_NAME, MOST_VALUE, MOST_WRITERS, is_far};
use crate::record::{Change, Delta, Record, Stamp, count};
use crate::replica::Replica;
use property_graph::{Id, MOST_BYTES, Value};
use std::collections::{BTreeMap, HashSet};

/// Refuses a name that no schema has: an empty or long one, or one with control characters.
pub(crate) fn check_name(name: &str, writer: u64) -> Result<(), Error> {
    let is_sound = (1..=MOST_NAME).contains(&name.len()) && !name.chars().any(char::is_control);
    is_sound.then_some(()).ok_or(Error::Name(writer))
}

/// Refuses a value that no graph holds, or that no message carries: a text of CDR ends with its first
/// zero byte.
pub(crate) fn check_value(value: &Value, writer: u64) -> Result<(), Error> {
    let most = match value {
        Value::Bytes(_) => MOST_BYTES,
        _ => MOST_VALUE,
    };
    let has_zero = match value {
        Value::Text(text) => text.contains('\0'),
        Value::Texts(all) => all.iter().any(|text| text.contains('\0')),
        Value::Sample(sample) => sample.topic.contains('\0') || sample.kind.contains('\0'),
        _ => false,
    };
    let is_sound = value.is_finite() && value.size() <= most && !has_zero;
    is_sound.then_some(()).ok_or(Error::Value(writer))
}

impl Replica {
    /// Refuses an element of this replica that no other one would take.
    pub(crate) fn check_new(&self, kind: &str) -> Result<(), Error> {
        check_name(kind, self.writer())?;
        if self.kept() >= self.most_elements {
            return Err(Error::TooManyElements(self.most_elements));
        }
        Ok(())
    }

    /// Refuses a value of this replica that no other one would take.
    pub(crate) fn check_set(&self, of: Id, name: &str, value: Option<&Value>) -> Result<(), Error> {
        let is_new = self.check_value(of, name, value)?;
        if is_new && self.attribute_count(of) >= MOST_ATTRIBUTES {
            return Err(Error::TooManyAttributes(MOST_ATTRIBUTES));
        }
        Ok(())
    }

    /// Whether the replica accepts a change as a whole: new elements of these types, and these
    /// attributes. It makes nothing that other replicas would refuse.
    ///
    /// # Errors
    /// No type or attribute has one of the names, no graph holds one of the values, or the replica
    /// would keep too many elements, or too many attributes of one of them.
    pub fn check_own<'a>(
        &self,
        kinds: impl IntoIterator<Item = &'a str>,
        set: impl IntoIterator<Item = (Id, &'a str, Option<&'a Value>)>,
    ) -> Result<(), Error> {
        let mut elements = self.kept();
        for kind in kinds {
            check_name(kind, self.writer())?;
            elements += 1;
            if elements > self.most_elements {
                return Err(Error::TooManyElements(self.most_elements));
            }
        }
        let mut new: BTreeMap<Id, HashSet<&str>> = BTreeMap::new();
        for (of, name, value) in set {
            if self.check_value(of, name, value)? {
                let names = new.entry(of).or_default();
                names.insert(name);
                if names.len() + self.attribute_count(of) > MOST_ATTRIBUTES {
                    return Err(Error::TooManyAttributes(MOST_ATTRIBUTES));
                }
            }
        }
        Ok(())
    }

    /// Whether an attribute would be new.
    fn check_value(&self, of: Id, name: &str, value: Option<&Value>) -> Result<bool, Error> {
        check_name(name, self.writer())?;
        if let Some(value) = value {
            check_value(value, self.writer())?;
        }
        let element = self.elements.get(&of);
        Ok(element.is_none_or(|element| !element.attributes.has(name)))
    }

    fn attribute_count(&self, of: Id) -> usize {
        let element = self.elements.get(&of);
        element.map_or(0, |element| element.attributes.len())
    }

    /// Refuses what no replica sends, as [`Replica::merge`] does, and changes nothing.
    ///
    /// # Errors
    /// Those of [`Replica::merge`].
    pub fn check(&self, delta: &Delta) -> Result<(), Error> {
        self.check_numbers(delta, is_far)
    }

    /// Refuses a change that no replica sends, as [`Replica::merge_change`] does, and changes nothing.
    ///
    /// # Errors
    /// Those of [`Replica::merge_change`].
    pub fn check_change(&self, change: &Change) -> Result<(), Error> {
        let is_own = change.writer == self.writer();
        let (since, upto) = if is_own {
            (change.since, change.upto)
        } else {
            (0, 0)
        };
        let most_own = self.most_own(true, since, upto);
        self.check_number(change.writer, change.upto, most_own, is_far)?;
        self.check_records(&change.records, most_own, is_far)?;
        let writers = std::iter::once(change.writer);
        self.check_counts(change.writer, writers, &change.records)
    }

    /// Checks as [`check`](Self::check). `is_far` says whether a number is too far ahead of the known
    /// one.
    pub(crate) fn check_numbers(
        &self,
        delta: &Delta,
        is_far: impl Fn(u64, u64) -> bool + Copy,
    ) -> Result<(), Error> {
        let is_complete = delta.all_of.is_none_or(|(_, ranges)| ranges <= 1);
        let (since, upto) = (&delta.since, &delta.upto);
        let [since, upto] = [since, upto].map(|of| count(of, self.writer()));
        let most_own = self.most_own(is_complete, since, upto);
        let vectors = [&delta.upto, &delta.seen, &delta.forgotten];
        for (writer, number) in vectors.into_iter().flatten() {
            self.check_number(*writer, *number, most_own, is_far)?;
        }
        self.check_records(&delta.records, most_own, is_far)?;
        self.check_counts(delta.sender, delta.upto.keys().copied(), &delta.records)
    }

    /// The greatest number that others may say of this writer, in changes of it after `since` up to `upto`.
    fn most_own(&self, is_complete: bool, since: u64, upto: u64) -> u64 {
        let own = count(self.seen(), self.writer());
        if is_complete && since <= own && !self.has_changed {
            own.max(upto)
        } else {
            own
        }
    }

    fn check_number(
        &self,
        writer: u64,
        number: u64,
        most_own: u64,
        is_far: impl Fn(u64, u64) -> bool,
    ) -> Result<(), Error> {
        if is_far(number, count(self.seen(), writer)) {
            return Err(Error::TooFar(writer));
        }
        if writer == self.writer() && number > most_own {
            return Err(Error::SameWriter(writer));
        }
        Ok(())
    }

    fn check_records(
        &self,
        records: &[Record],
        most_own: u64,
        is_far: impl Fn(u64, u64) -> bool + Copy,
    ) -> Result<(), Error> {
        let sequence =
            |writer: u64, number: u64| self.check_number(writer, number, most_own, is_far);
        for record in records {
            let (stamp, id) = (record.stamp(), record.of());
            if stamp.sequence == 0 || stamp.count == 0 {
                return Err(Error::NoNumber(stamp.writer));
            }
            if is_far(stamp.count, self.count()) {
                return Err(Error::TooFar(stamp.writer));
            }
            sequence(stamp.writer, stamp.sequence)?;
            sequence(id.writer(), id.count())?;
            if let Record::Edge { from, to, .. } = record {
                for end in [from, to] {
                    sequence(end.writer(), end.count())?;
                }
            }
            self.check_record(record, stamp)?;
        }
        Ok(())
    }

    fn check_record(&self, record: &Record, stamp: Stamp) -> Result<(), Error> {
        match record {
            Record::Node { kind, .. } | Record::Edge { kind, .. } => {
                check_name(kind, stamp.writer)?;
            }
            Record::Attribute { name, value, .. } => {
                check_name(name, stamp.writer)?;
                if let Some(value) = value {
                    check_value(value, stamp.writer)?;
                }
            }
            Record::Removed { .. } => {}
        }
        // The replica itself is the authority on its own changes.
        if stamp.writer == self.writer() && self.contradicts(record) {
            return Err(Error::SameWriter(stamp.writer));
        }
        Ok(())
    }

    /// Refuses more than a replica keeps.
    fn check_counts(
        &self,
        sender: u64,
        writers: impl ExactSizeIterator<Item = u64>,
        records: &[Record],
    ) -> Result<(), Error> {
        let count = records.len();
        let most_attributes = |of: Id| self.attribute_count(of) + count <= MOST_ATTRIBUTES;
        let are_few = self.kept() + count <= self.most_elements
            && self.seen().len() + writers.len() + count <= MOST_WRITERS
            && records.iter().all(|record| most_attributes(record.of()));
        // The usual case: as many could be new, and none is too many.
        if !are_few {
            self.check_new_ones(writers.collect(), records)?;
        }
        let is_new = sender != self.writer() && !self.others.contains_key(&sender);
        if is_new && self.others.len() >= MOST_WRITERS {
            return Err(Error::TooManyWriters(MOST_WRITERS));
        }
        Ok(())
    }

    /// Refuses more writers, elements and attributes than a replica keeps.
    #[cold]
    fn check_new_ones(&self, mut writers: HashSet<u64>, records: &[Record]) -> Result<(), Error> {
        let mut new: HashSet<Id> = HashSet::new();
        let mut names: BTreeMap<Id, HashSet<&str>> = BTreeMap::new();
        for record in records {
            let id = record.of();
            writers.insert(record.stamp().writer);
            let element = self.elements.get(&id);
            if element.is_none() {
                new.insert(id);
            }
            if let Record::Attribute { name, .. } = record {
                let known = element.is_some_and(|e| e.attributes.has(name));
                if !known {
                    let names = names.entry(id).or_default();
                    names.insert(name);
                    if names.len() + self.attribute_count(id) > MOST_ATTRIBUTES {
                        return Err(Error::TooManyAttributes(MOST_ATTRIBUTES));
                    }
                }
            }
        }
        if !new.is_empty() && self.kept() + new.len() > self.most_elements {
            return Err(Error::TooManyElements(self.most_elements));
        }
        writers.retain(|writer| !self.seen().contains_key(writer));
        if !writers.is_empty() && self.seen().len() + writers.len() > MOST_WRITERS {
            return Err(Error::TooManyWriters(MOST_WRITERS));
        }
        Ok(())
    }
}
