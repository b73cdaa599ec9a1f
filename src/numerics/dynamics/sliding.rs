//! Units of a joint that slides: N and m where one that turns has Nm and rad.

/// Of a joint that turns and of one that slides, longer ones first.
const UNITS: [(&str, &str); 10] = [
    ("Nm s/rad", "N s/m"),
    ("Nm/rad3", "N/m3"),
    ("Nm/rad2", "N/m2"),
    ("Nm/rad", "N/m"),
    ("kg m2", "kg"),
    ("rad/s2", "m/s2"),
    ("rad/s", "m/s"),
    ("Nm/A", "N/A"),
    ("Nm", "N"),
    ("rad", "m"),
];

/// The unit of a number of a joint by that of one that turns.
pub fn unit_at(slides: bool, unit: &'static str) -> &'static str {
    let known = UNITS.iter().find(|(turning, _)| slides && *turning == unit);
    known.map_or(unit, |(_, sliding)| sliding)
}

/// A sentence on a joint by that of one that turns.
pub(super) fn said_at(slides: bool, sentence: String) -> String {
    if !slides {
        return sentence;
    }
    let ends = |rest: &str| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '/');
    let (mut said, mut rest) = (String::with_capacity(sentence.len()), &sentence[..]);
    while let Some(at) = rest.find(' ') {
        said.push_str(&rest[..=at]);
        rest = &rest[at + 1..];
        let mut all = UNITS.iter();
        let found = all.find(|(turning, _)| rest.strip_prefix(turning).is_some_and(ends));
        if let Some((turning, sliding)) = found {
            said.push_str(sliding);
            rest = &rest[turning.len()..];
        }
    }
    said + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_of_a_sliding_joint_is_in_newtons_and_metres() {
        let said =
            "friction of joint 1 begins 2.0 Nm and 0.5 Nm s/rad higher, over 0.1 rad/s: 3 Nm";
        assert_eq!(
            said_at(true, said.into()),
            "friction of joint 1 begins 2.0 N and 0.5 N s/m higher, over 0.1 m/s: 3 N"
        );
        assert_eq!(said_at(false, said.into()), said);
        assert_eq!(
            [
                unit_at(true, "Nm s/rad"),
                unit_at(true, "s"),
                unit_at(false, "Nm")
            ],
            ["N s/m", "s", "Nm"]
        );
    }
}
