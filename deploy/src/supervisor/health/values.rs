//! Values that a component refused, since they have no counterpart in what it converts them to.

use super::{CALM, HealthEvent, HealthMonitor, end_of};
use rc_management::component::ConvertedStatus;
use rc_management::event::Severity;
use std::collections::BTreeMap;

impl HealthMonitor {
    /// Values that slots refused, because they have no counterpart in what they are converted to.
    pub(crate) fn converted(
        &mut self,
        converted: &BTreeMap<String, ConvertedStatus>,
    ) -> Vec<HealthEvent> {
        let mut happened = Vec::new();
        if self.quiet {
            return happened;
        }
        for (slot, status) in converted {
            let (before, calm) = self.bad_values.entry(slot.clone()).or_default();
            let new = status.bad_values.saturating_sub(*before);
            *before = status.bad_values;
            let (was, is_over) = (*calm > 0, new == 0 && end_of(calm));
            if new > 0 {
                *calm = CALM;
                let messages = match new {
                    1 => "a message".to_owned(),
                    new => format!("{new} messages, the last one"),
                };
                let reason = status.bad_value.as_deref().unwrap_or("from its provider");
                let text = format!("slot {slot} refused {messages} {reason}");
                self.begin("bad-value", slot, &text);
                if !was {
                    happened.push((Severity::Warning, "bad-value", text));
                }
            } else if is_over {
                self.over("bad-value", slot);
                let text = format!("slot {slot} refuses no values any more");
                happened.push((Severity::Info, "good-values", text));
            }
        }
        happened
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn codes(happened: &[HealthEvent]) -> Vec<&'static str> {
        happened.iter().map(|(_, code, _)| *code).collect()
    }

    #[test]
    fn refused_values_are_reported_once_until_none_comes() {
        let mut watch = HealthMonitor::default();
        let mut beat = |bad_values: u64| {
            let reason = (bad_values > 0).then(|| "from `lidar.Cloud`: no length".to_owned());
            let status = ConvertedStatus {
                bad_values,
                bad_value: reason,
                ..ConvertedStatus::default()
            };
            let happened = watch.converted(&BTreeMap::from([("Clouds".to_owned(), status)]));
            let troubles = watch.troubles();
            (happened, troubles)
        };
        assert_eq!(beat(0), (vec![], vec![]));
        let (happened, troubles) = beat(1);
        let text = "slot Clouds refused a message from `lidar.Cloud`: no length";
        assert_eq!(
            happened,
            [(Severity::Warning, "bad-value", text.to_owned())]
        );
        assert_eq!(
            (troubles[0].code.as_str(), &*troubles[0].message),
            ("bad-value", text)
        );
        let (happened, troubles) = beat(4);
        let text = "slot Clouds refused 3 messages, the last one from `lidar.Cloud`: no length";
        assert_eq!((happened, &*troubles[0].message), (vec![], text));
        for _ in 1..CALM {
            assert_eq!(codes(&beat(4).0), [""; 0]);
        }
        let (happened, troubles) = beat(4);
        assert_eq!((codes(&happened), troubles), (vec!["good-values"], vec![]));
        assert_eq!(codes(&beat(5).0), ["bad-value"]);
    }
}
