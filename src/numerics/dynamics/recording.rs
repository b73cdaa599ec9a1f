//! A recording of joint torques while the arm moves: arrays in SI on the joint side, rows in the order of time.

/// Rows of n joints, row-major (rows x n).
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueRecording {
    /// Number of joints n.
    pub joints: usize,
    /// s, ascending inside a trajectory; length rows.
    pub time: Vec<f64>,
    /// rad (m for a prismatic joint), rows x n.
    pub position: Vec<f64>,
    /// rad/s, rows x n, where the controller gives it. `None`: found from positions.
    pub velocity: Option<Vec<f64>>,
    /// Nm at the joint, rows x n: a torque sensor's, or current times ratio and torque constant.
    pub torque: Vec<f64>,
    /// Of the gears, K or degrees C; length rows.
    pub temperature: Option<Vec<f64>>,
    /// Which trajectory a row belongs to, length rows: nothing is filtered from one into the next unless the clock goes on without a gap.
    pub trajectory: Vec<u32>,
    /// Rows that judge in the end and choose nothing, length rows.
    pub held_out: Vec<bool>,
    /// Whether torques are motor currents times ratio and torque constant; else a torque sensor's.
    pub from_current: bool,
}

impl TorqueRecording {
    /// A motion of one trajectory without torques, s and rad, positions row-major.
    pub(super) fn of_motion(joints: usize, time: Vec<f64>, position: Vec<f64>) -> Self {
        let rows = time.len();
        Self {
            joints,
            time,
            position,
            velocity: None,
            torque: Vec::new(),
            temperature: None,
            trajectory: vec![1; rows],
            held_out: vec![false; rows],
            from_current: false,
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.time.len()
    }
}
