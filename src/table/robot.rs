//! The robot as a table: base, joints, tool; at the zero pose in the base frame.

crate::table::rows! { "robot",
    /// Bodies, one a row; key `body`: 0 the base, 1..n the joints, n+1 the tool (its mass and centre are the payload's).
    pub struct Robot of RobotRow {
        body: i64,
        name: String,
        /// `base`, `revolute`, `prismatic`, `tool`.
        kind: String,
        /// Unit vector: joint axis; base: direction of gravity; tool: null.
        axis_x: Option<f64>,
        axis_y: Option<f64>,
        axis_z: Option<f64>,
        /// Point on the axis; tool: the measured point.
        point_x_mm: Option<f64>,
        point_y_mm: Option<f64>,
        point_z_mm: Option<f64>,
        lower_rad: Option<f64>,
        upper_rad: Option<f64>,
        lower_mm: Option<f64>,
        upper_mm: Option<f64>,
        reduction_ratio: Option<f64>,
        motor_constant_nm_a: Option<f64>,
        mass_kg: Option<f64>,
        centre_x_mm: Option<f64>,
        centre_y_mm: Option<f64>,
        centre_z_mm: Option<f64>,
        /// Orientation of the tool frame at the zero pose, unit quaternion; null but for the tool.
        orientation_w: Option<f64>,
        orientation_x: Option<f64>,
        orientation_y: Option<f64>,
        orientation_z: Option<f64>,
        /// Base only: acceleration of gravity.
        gravity_m_s2: Option<f64>,
        /// Joints that move this one, JSON `[{"by": 5, "ratio": 0.0}]`, joints from 1.
        couplings: Option<String>,
    }
}
