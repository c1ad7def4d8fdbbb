//! A voice: texts wait in a queue, and the one that is spoken takes its time.

use std::collections::VecDeque;
use std::time::Duration;

/// The spoken text and the waiting ones.
#[derive(Clone, Debug, Default)]
pub(crate) struct Voice {
    waiting: VecDeque<String>,
    spoken: Option<Spoken>,
    /// Whether every word is announced when it is spoken, instead of the whole text when it begins.
    pub(crate) synchronized: bool,
}

#[derive(Clone, Debug)]
struct Spoken {
    text: String,
    elapsed: Duration,
    /// How many words were announced.
    words: usize,
}

impl Voice {
    /// Queues a text; false if `limit` texts wait already.
    pub(crate) fn say(&mut self, text: String, limit: usize) -> bool {
        if self.waiting.len() >= limit {
            return false;
        }
        self.waiting.push_back(text);
        true
    }

    /// Drops the spoken text and the waiting ones.
    pub(crate) fn silence(&mut self) {
        self.waiting.clear();
        self.spoken = None;
    }

    /// Whether something is spoken or waits.
    pub(crate) fn is_busy(&self) -> bool {
        self.spoken.is_some() || !self.waiting.is_empty()
    }

    /// Advances the time and returns the announcements of that time, in order. A character takes
    /// `per_character`.
    pub(crate) fn advance(&mut self, mut time: Duration, per_character: Duration) -> Vec<String> {
        let mut announced = Vec::new();
        loop {
            if self.spoken.is_none() {
                let Some(text) = self.waiting.pop_front() else {
                    break;
                };
                if !self.synchronized {
                    announced.push(text.clone());
                }
                self.spoken = Some(Spoken {
                    text,
                    elapsed: Duration::ZERO,
                    words: 0,
                });
            }
            let Some(spoken) = &mut self.spoken else {
                break;
            };
            let duration = time_of(spoken.text.chars().count(), per_character);
            let passing = time.min(duration.saturating_sub(spoken.elapsed));
            spoken.elapsed += passing;
            time -= passing;
            let begun = spoken.words_begun(per_character);
            if self.synchronized {
                announced.extend(begun);
            }
            if spoken.elapsed < duration {
                break;
            }
            self.spoken = None;
        }
        announced
    }
}

impl Spoken {
    /// The words that began since this was last asked.
    fn words_begun(&mut self, per_character: Duration) -> Vec<String> {
        let (mut begun, mut count) = (Vec::new(), 0);
        for (index, word) in words(&self.text) {
            count += 1;
            if count > self.words && time_of(index, per_character) <= self.elapsed {
                self.words = count;
                begun.push(word.to_owned());
            }
        }
        begun
    }
}

/// The words of a text, each with the number of characters before it.
fn words(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut start = 0;
    text.split(char::is_whitespace).filter_map(move |word| {
        let at = start;
        start += word.chars().count() + 1;
        (!word.is_empty()).then_some((at, word))
    })
}

fn time_of(characters: usize, per_character: Duration) -> Duration {
    per_character.saturating_mul(u32::try_from(characters).unwrap_or(u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CHARACTER: Duration = Duration::from_millis(10);

    fn passed(voice: &mut Voice, milliseconds: u64) -> Vec<String> {
        voice.advance(Duration::from_millis(milliseconds), CHARACTER)
    }

    fn voice(texts: &[&str]) -> Voice {
        let mut voice = Voice::default();
        assert!(texts.iter().all(|text| voice.say((*text).to_owned(), 8)));
        voice
    }

    #[test]
    fn a_text_is_announced_when_it_begins_and_takes_its_time() {
        let mut voice = voice(&["hello you"]);
        assert!(voice.is_busy());
        assert_eq!(passed(&mut voice, 50), ["hello you"]);
        assert!(passed(&mut voice, 39).is_empty() && voice.is_busy());
        assert!(passed(&mut voice, 1).is_empty() && !voice.is_busy());
    }

    #[test]
    fn texts_follow_each_other_and_no_time_is_lost() {
        let mut voice = voice(&["one", "two", "three"]);
        assert_eq!(passed(&mut voice, 65), ["one", "two", "three"]);
        assert!(voice.is_busy());
        passed(&mut voice, 45);
        assert!(!voice.is_busy());
    }

    #[test]
    fn a_full_queue_refuses() {
        let mut voice = Voice::default();
        assert!(voice.say("one".to_owned(), 1));
        assert!(!voice.say("two".to_owned(), 1));
        passed(&mut voice, 1);
        assert!(voice.say("two".to_owned(), 1));
    }

    #[test]
    fn synchronized_words_come_one_by_one() {
        let mut voice = voice(&["a  good day"]);
        voice.synchronized = true;
        assert_eq!(passed(&mut voice, 0), ["a"]);
        assert!(passed(&mut voice, 29).is_empty());
        assert_eq!(passed(&mut voice, 1), ["good"]);
        assert_eq!(passed(&mut voice, 500), ["day"]);
        assert!(!voice.is_busy());
    }

    #[test]
    fn silence_forgets_everything() {
        let mut voice = voice(&["one", "two"]);
        passed(&mut voice, 10);
        voice.silence();
        assert!(!voice.is_busy() && passed(&mut voice, 100).is_empty());
    }
}
