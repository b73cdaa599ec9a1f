//! How large a number of a robot, or of a target, may be: what is beyond is in another unit, damaged, or no robot's.

/// rad: more is seldom a position of a joint, but a common one in degrees.
pub const ONE_AND_A_HALF_TURNS: f64 = 3.0 * std::f64::consts::PI;

/// What is wrong with joints of which most rows turn too far; `value`: that of a joint (from 0), rad.
pub fn too_far(name: &str, unit: &str, rows: [u64; 2], joint: usize, value: f64) -> String {
    let [far, all] = rows;
    let (shown, symbol, most) = match unit {
        "rad" => (value, "rad", "9.42"),
        _ => (value.to_degrees(), "deg", "540"),
    };
    format!(
        "`{name}` is declared in {unit}, but {far} of {all} rows hold a joint beyond one and a half turns, here joint {} at {shown:.4} {symbol}; allowed: up to {most} {symbol}",
        joint + 1
    )
}

/// What a number is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// A coordinate or a length, m.
    Length,
    /// Along the axis of a Denavit-Hartenberg joint, m: nearly parallel axes come closest to each other far away.
    Offset,
    /// rad.
    Angle,
    /// kg.
    Mass,
    /// kg m2.
    Inertia,
    /// Motor turns per turn of the joint, torque per current, turns of one joint by another.
    Factor,
}

impl Bound {
    /// The largest size, its unit, and what may be meant instead.
    fn most(self) -> (f64, &'static str, &'static str) {
        match self {
            // The longest tracks are 100 m.
            Self::Length => (1e3, "m", "; is it in another unit?"),
            // Axes that are parallel to 1e-9 rad at 1 m.
            Self::Offset => (1e9, "m", "; is it in another unit?"),
            // Ten turns: more is an angle in degrees.
            Self::Angle => (63.0, "rad", ", ten turns; is it in another unit?"),
            // The heaviest robots are 10 t.
            Self::Mass => (1e6, "kg", "; is it in another unit?"),
            Self::Inertia => (1e7, "kg m2", "; is it in another unit?"),
            Self::Factor => (1e6, "", ""),
        }
    }

    /// What is wrong with a value in SI; nothing of NaN, which stands for what could not be read.
    pub fn fault(self, value: f64) -> Option<String> {
        let (most, unit, instead) = self.most();
        let number = |value: f64| {
            if value.abs() < 1e6 {
                format!("{value}")
            } else {
                format!("{value:e}")
            }
        };
        (value.abs() > most)
            .then(|| format!("{} {unit}", number(value)).trim_end().to_string())
            .map(|shown| {
                let most = format!("{} {unit}", number(most));
                format!("{shown} is more than {}{instead}", most.trim_end())
            })
    }
}

#[cfg(test)]
mod tests {
    use super::Bound;

    #[test]
    fn what_no_robot_has_is_told_with_its_size() {
        assert_eq!(
            Bound::Length.fault(-1e305).as_deref(),
            Some("-1e305 m is more than 1000 m; is it in another unit?")
        );
        assert_eq!(
            Bound::Angle.fault(180.0).as_deref(),
            Some("180 rad is more than 63 rad, ten turns; is it in another unit?")
        );
        assert_eq!(
            Bound::Factor.fault(f64::INFINITY).as_deref(),
            Some("inf is more than 1e6")
        );
        assert_eq!(
            [
                Bound::Length.fault(999.0),
                Bound::Angle.fault(-62.8),
                Bound::Mass.fault(f64::NAN)
            ],
            [None, None, None]
        );
    }
}
