//! The words that people use in headers, in small letters, with blanks between them: English, German, French, Spanish, Italian.

/// Whether a word is one of a list.
pub(super) fn lists(list: &str, word: &str) -> bool {
    list.split(' ').any(|listed| listed == word)
}

/// What the joints' columns are usually called; the number of the joint follows.
pub(super) const JOINTS: &str = "q a rax j joint axis theta achse gelenk axe asse eje jnt joint_angle joint_state joint_states \
    observation_state qpos observation_qpos articulación";

/// Names of joints without numbers.
pub(super) const NAMED_JOINTS: [&[&str]; 3] = [
    &["s", "l", "u", "r", "b", "t"],
    &["s", "l", "e", "u", "r", "b", "t"],
    &[
        "shoulder_pan",
        "shoulder_lift",
        "elbow",
        "wrist_1",
        "wrist_2",
        "wrist_3",
    ],
];

/// What joint torques, motor currents and joint velocities are called beside the number or name of a joint.
pub(super) const TORQUES: &str = "tau torque torques trq effort efforts moment moments drehmoment drehmomente couple coppia momento \
    momente";
pub(super) const CURRENTS: &str =
    "i iq cur curr current currents strom courant corriente corrente amps";
pub(super) const VELOCITIES: &str = "dq qd qdot vel vels velocity velocities speed speeds geschwindigkeit vitesse velocidad velocità rate";
/// Which of several movements a row belongs to.
pub(super) const TRAJECTORIES: &str =
    "traj trajectory trajectory_id episode episode_index run segment";

/// What else a numbered column that is no joint position is called.
pub(super) const NO_JOINTS: &str = "dir temp motor load err error sigma std acc accel e ddq qdd force forces ft wrench strain gauge \
    sensor channel ch ai di do io input output volt voltage power pressure tcp pose cartesian marker dist \
    distance";

/// What the parts of a quaternion are called before `w`, `x`, `y`, `z`.
pub(super) const QUATERNIONS: [&str; 6] =
    ["q", "q_", "quat_", "quaternion_", "rot_", "orientation_"];

/// What stands beside the name of an axis where several points are in one table.
pub(super) const MEASURED: &str = "ist actual act meas measured measurement mess gemessen real tracker laser lt mes mesure mesuré \
    mesurée medido medida misurato";
pub(super) const WANTED: &str = "soll nom nominal cmd command commanded target wanted ref reference programmed goal desired setpoint \
    planned plan cad theo theoretical théorique teórico teorico consigne robot controller steuerung sim \
    simulated model";
pub(super) const DIFFERENCE: &str = "dif diff difference differenz d delta dev deviation abw abweichung err error fehler écart ecart desv \
    desviación erreur";
/// Differences that are usually target less measured point; others are measured point less target.
pub(super) const TARGET_LESS_MEASURED: &str = "dif diff difference differenz";
pub(super) const SIGMA: &str =
    "std stdev stddev sigma sd u unc uncertainty unsicherheit rms σ s u95";
/// What columns of uncertainties with 95 % coverage are called.
pub(super) const U95: &str = "u95";

/// What columns of points' names are called.
pub(super) const IDS: &str = "point point_id pointid point_name pointname id name pose pose_id nr no number nummer num punkt \
    punktname punktnummer punkt_nr messpunkt bezeichnung index label target measurement pt pts p nom \
    nombre nome punto point_no row sample messung repere repère n";
pub(super) const PAYLOADS: &str = "payload payload_mass load mass weight last traglast nutzlast zuladung gewicht masse lastmasse charge \
    charge_utile poids carga carga_util carga_útil peso masa carico load_mass tool_load";
pub(super) const TEMPERATURES: &str =
    "temp temperature temperatur température temperatura temps_c raumtemperatur";
pub(super) const TIMES: &str = "time t timestamp stamp zeit zeitstempel messzeit uhrzeit temps horodatage heure tiempo hora tempo \
    clock";
pub(super) const USAGES: &str = "use usage set verwendung split";
/// Which of several reflectors was measured.
pub(super) const REFLECTORS: &str = "target smr reflector reflektor retro prism";
