//! What may be stated of the circumstances of a target, by an option of a command or by a column of targets.

/// A circumstance that a person states.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stated {
    /// Mass at the tool, kg.
    Payload,
    /// C.
    Temperature,
    /// Side from which a joint comes to rest.
    Direction,
}

/// C.
const ABSOLUTE_ZERO: f64 = -273.15;

impl Stated {
    /// What is wrong with a number of it, and what is allowed.
    pub fn fault(self, value: f64) -> Option<String> {
        let (holds, allowed) = match self {
            Self::Payload => (value >= 0.0, "a mass of 0 or more, kg"),
            Self::Temperature => (value > ABSOLUTE_ZERO, "a temperature above -273.15 C"),
            Self::Direction => (
                [-1.0, 0.0, 1.0].contains(&value),
                "a direction: 1, -1, or 0 where it is not known",
            ),
        };
        (!(holds && value.is_finite())).then(|| format!("expected {allowed}, found {value}"))
    }
}

#[cfg(test)]
mod tests {
    use super::Stated;

    #[test]
    fn what_no_circumstance_can_be_is_told_with_what_is_allowed() {
        assert_eq!(
            Stated::Payload.fault(-5.0).as_deref(),
            Some("expected a mass of 0 or more, kg, found -5")
        );
        assert_eq!(
            Stated::Temperature.fault(-500.0).as_deref(),
            Some("expected a temperature above -273.15 C, found -500")
        );
        assert!(
            Stated::Direction
                .fault(7.0)
                .is_some_and(|said| said.ends_with(", found 7"))
        );
        assert!(
            Stated::Payload.fault(f64::INFINITY).is_some()
                && Stated::Temperature.fault(f64::NAN).is_some()
        );
        let sound = [
            (Stated::Payload, 0.0),
            (Stated::Temperature, -273.0),
            (Stated::Direction, -1.0),
            (Stated::Direction, 0.0),
        ];
        assert!(
            sound
                .into_iter()
                .all(|(stated, value)| stated.fault(value).is_none())
        );
    }
}
