"""The unmutated files: a small cell that calib identifies, its programs, targets, tables, URDFs and pipelines."""
import json
import math
import pathlib
import random
import shutil
import subprocess

from . import arm

HERE = pathlib.Path(__file__).resolve().parent
URDFS = HERE.parent / "kinematics"

ROBOT = """calib_robot: 1
name: small
units: {length: mm, angle: deg}
kinematics:
  screws:
    - {axis: [0, 0, 1], point: [0, 0, 0]}
    - {axis: [0, 1, 0], point: [0, 0, 400]}
    - {axis: [0, 1, 0], point: [0, 0, 900]}
    - {axis: [1, 0, 0], point: [500, 0, 900]}
    - {axis: [0, 1, 0], point: [700, 0, 900]}
    - {axis: [1, 0, 0], point: [700, 0, 900]}
tool: {point: [830, 40, 930]}
joints:
  - {name: K1, limits: [-175, 175]}
  - {name: K2, limits: [-60, 75]}
  - {name: K3, limits: [-80, 75]}
  - {name: K4, limits: [-170, 170]}
  - {name: K5, limits: [-125, 125]}
  - {name: K6, limits: [-350, 350]}
"""
NAMES = ["k1", "k2", "k3", "k4", "k5", "k6"]
JOINTS = [((0.0, 0.0, 1.0), (0.0, 0.0, 0.0)), ((0.0, 1.0, 0.0), (0.0, 0.0, 0.4)), ((0.0, 1.0, 0.0), (0.0, 0.0, 0.9)),
          ((1.0, 0.0, 0.0), (0.5, 0.0, 0.9)), ((0.0, 1.0, 0.0), (0.7, 0.0, 0.9)), ((1.0, 0.0, 0.0), (0.7, 0.0, 0.9))]
TOOL = (arm.Y, (0.83, 0.04, 0.93))
START = [0.0, 0.0, 0.0, 0.0, 0.5, 0.0]

DH = """calib_robot: 1
name: table
units: {length: mm, angle: deg}
kinematics:
  dh:
    - {theta: 0, d: 400, a: 100, alpha: -90}
    - {theta: -90, d: 0, a: 500, alpha: 0}
    - {theta: 0, d: 0, a: 50, alpha: -90}
    - {theta: 0, d: 450, a: 0, alpha: 90}
    - {theta: 0, d: 0, a: 0, alpha: -90}
    - {theta: 0, d: 90, a: 0, alpha: 0}
tool: {point: [10, 20, 130], orientation: {rpy: [0, 30, 0]}}
links:
  - {mass: 80, centre: [0, 0, 200]}
  - {mass: 60, centre: [0, 0, 600], frame: base}
  - {mass: 40, centre: [10, 0, 0], frame: link}
  - {mass: 20, centre: [0, 0, 0], frame: link}
  - {mass: 9, centre: [0, 0, 0], frame: link}
  - {mass: 2, centre: [0, 0, 0], frame: link}
payload: {mass: 20, centre: [0, 0, 50]}
couplings:
  - {moved: 6, by: 5, ratio: 0.01}
gravity: [0, 0, -9.81]
"""

PIPELINE = """calib: 1
name: small
seed: 3
stages:
  - uses: robot
    with: {file: robot.yaml}
  - uses: simulate
    with:
      truth:
        offset_deg: [0.02, -0.05, 0.04, 0.03, -0.06, 0.0]
        ratio: [1.0004, 0.9997, 1.0005, 1.0008, 0.9994, 1.0006]
        links:
          - {link: 2, shift_mm: [0.4, 0.2, -0.3], tilt_arcsec: [60, -80, 40]}
          - {link: 5, shift_mm: [0.2, -0.3, 0.1], tilt_arcsec: [90, 50, -70]}
      tracker: {position_mm: [0, 0, 0], roll_pitch_yaw_deg: [0, 0, 0]}
      poses: {floor_mm: 100, clearance_mm: 200}
      blocks: [{usage: fit, points: 60}, {usage: validate, points: 20}]
  - uses: split
    with: {by: usage}
  - id: geometry
    uses: identify
    with: {on: [fit], effects: [base_frame, tool_offset, joint_offset, link_geometry, reduction_ratio]}
"""

SHORT = """calib: 1
name: short
seed: 5
variables:
  robot: robot.yaml
stages:
  - uses: robot
    with: {file: "${robot}"}
  - uses: simulate
    with:
      truth: {offset_deg: [0.02, -0.05, 0.04, 0.03, -0.06, 0.0]}
      tracker: {position_mm: [4500, -1800, 900], noise_um: 10, coverage: 2}
      poses: {floor_mm: 100, clearance_mm: 200, candidates: 200}
      climate: {pace_s: [8, 20], warm_up_h: 1}
      blocks: [{usage: fit, points: 20, payload_kg: 0}, {usage: validate, points: 6}]
  - uses: split
    with: {by: every, n: 4}
  - id: nominal
    uses: identify
    with: {effects: [base_frame]}
  - id: geometry
    uses: identify
    with: {effects: [base_frame, joint_offset]}
"""

TAKE_IN = """calib: 1
name: taken
stages:
  - uses: robot
    with: {file: robot.yaml}
  - uses: ingest
    with:
      files:
        - file: m.parquet
          columns:
            q: {column: "q{j}_rad", unit: rad}
            x: {column: x_mm, unit: mm}
            y: {column: y_mm, unit: mm}
            z: {column: z_mm, unit: mm}
            payload: {column: payload_kg, unit: kg}
            time: {column: time_s, unit: s}
"""

KRL = """&ACCESS RVO
DEF weld( )
DECL E6AXIS HOME={A1 0.0,A2 -20.0,A3 40.0,A4 0,A5 30.0,A6 0.0,E1 0,E2 0,E3 0,E4 0,E5 0,E6 0}
DECL FRAME part={X 100.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}
BAS(#INITMOV,0)
; not a target: PTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}
PTP {A1 10.5,A2 -20.25,A3 30,A4 5,A5 40,A6 306.25} C_PTP
MsgNotify("at {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}")
PTP {E6AXIS: A1 -35.0,A2 12.5,A3 -10.0,A4 60.0,A5 -45.5,A6 170.0}
PTP HOME
LIN {X 800.0,Y 100.0,Z 700.0,A 10.0,B 5.0,C -8.0} C_DIS
LIN {E6POS: X 850.5,Y -120.25,Z 655.0,A -20.0,B 12.5,C 15.0}
END
"""

KRL_DATA = """DEFDAT  WELD
DECL E6POS XP1={X 780.25,Y -55.5,Z 812.0,A 15.0,B 25.0,C 3.0,S 6,T 27,E1 0.0,E2 0.0,E3 0.0,E4 0.0,E5 0.0,E6 0.0}
DECL AXIS XP2={A1 45.0,A2 -15.0,A3 25.0,A4 -60.0,A5 35.0,A6 -120.5}
DECL FDAT FP1={TOOL_NO 1,BASE_NO 0,IPO_FRAME #BASE,POINT2[] " "}
ENDDAT
"""

RAPID = """MODULE Weld
  CONST jointtarget jHome:=[[0,-20,40,0,30,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pA:=[[800,100,700],[0.99,0.0871557,0.0435779,0.1015],[0,-1,0,1],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  PERS tooldata tGun:=[TRUE,[[0,0,100],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  ! MoveAbsJ [[1,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tool0;
  VAR robtarget pB{2}:=[[[780.5,-60,810],[1,0,0,0],[-1,-1,0,1],[9E9,9E9,9E9,9E9,9E9,9E9]],
    [[850.5,-120.25,655],[0.9659258,0,0.2588190,0],[-1,0,-1,0],[9E9,9E9,9E9,9E9,9E9,9E9]]];
  PROC main()
    MoveAbsJ [[10.3,-20,30,5,40,170.25],[9E9,9E9,9E9,9E9,9E9,9E9]]\\NoEOffs,v100,fine,tool0;
    MoveL [[825.5,20.25,705],[1,0,0,0],[-1,-1,0,1],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,tool0;
    TPWrite "at [[1,2,3,4,5,6],[0,0,0,0,0,0]]";
  ENDPROC
ENDMODULE
"""

JOINT_TEXT = ("name;q1_deg;q2_deg;q3_deg;q4_deg;q5_deg;q6_deg;note\n"
              + "".join(f"P{k};{10.5 - 9 * k:.3f};{-20 + 4.25 * k};{30 - 3 * k};{5 + k};{40 - k};{-60 + 30.125 * k};n\n" for k in range(8)))
JOINT_NAMES = ("K1_deg,K2_deg,K3_deg,K4_deg,K5_deg,K6_deg,payload_kg\r\n"
               + "".join(f"{10.5 + 9 * k:.3f},{-20 + 4.25 * k},{30 - 3 * k},{5 + k},{40 - k},\"{-60 + 30.125 * k}\",0\r\n" for k in range(8)))
COMMA_TEXT = JOINT_TEXT.replace(".", ",")
POSE_TEXT = ("x_mm,y_mm,z_mm,a_deg,b_deg,c_deg,label\n"
             + "".join(f"{800 + 5 * k},{100 - 20 * k},{700 + 6.25 * k},{10 - 4 * k},{5 + k},{-8 + 3 * k},p{k}\n" for k in range(5)))
QUATERNION_TEXT = ("x_m\ty_m\tz_m\tqw\tqx\tqy\tqz\n" + "".join(
    f"{0.8 + 0.005 * k}\t{0.1 - 0.02 * k}\t0.7\t{math.cos(0.1 * k + 0.1):.9f}\t0\t{math.sin(0.1 * k + 0.1):.9f}\t0\n" for k in range(4)))
POINT_TEXT = "x_mm,y_mm,z_mm\n800,100,700\n820,-50,705.5\n790,0,640\n"

TARGETS = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n10,20,-30,5,40,0\n-60,5,25,-50,35,100\n"


def call(calib, folder, *arguments):
    done = subprocess.run([calib, *arguments], cwd=folder, capture_output=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(arguments)}: {done.returncode}: {done.stderr.decode()}")
    return done.stdout


class Cell:
    """A folder with an identified robot, and the two arms as this script knows them."""

    def __init__(self, calib, folder):
        self.folder = folder
        (folder / "robot.yaml").write_text(ROBOT)
        (folder / "pipeline.yaml").write_text(PIPELINE)
        call(calib, folder, "run", "pipeline.yaml", "--quiet")
        rows = json.loads(call(calib, folder, "query", "HEAD", "SELECT name, unit, value FROM geometry_parameters", "--json"))
        self.parameters = {row["name"]: row["value"] * (1e-3 if row["unit"] == "mm" else 1.0) for row in rows}
        tables = folder / ".calib/tables/small"
        for name, table in [("parameters", "geometry.parameters"), ("robot", "robot.robot"), ("recording", "simulate.recording")]:
            shutil.copyfile(tables / f"{table}.parquet", folder / f"{name}.parquet")
        (folder / "targets.csv").write_text(TARGETS)
        model = ["compensate", "parameters.parquet", "--robot", "robot.yaml", "--quiet"]
        for what in ("joints", "pose"):
            call(calib, folder, *model, "recording.parquet", "--target", what, "--plain", "--out", f"{what}.parquet")
        self.expected = call(calib, folder, *model, "targets.csv")
        shutil.rmtree(folder / ".calib")
        self.nominal, self.real = arm.Arm(JOINTS, TOOL), arm.Arm(JOINTS, TOOL, self.parameters)

    def starts(self):
        """Where postures of Cartesian targets are searched from: as the command is told, and some more."""
        r = random.Random(1)
        return [START] + [[r.uniform(-1, 1) for _ in range(6)] for _ in range(3)]


def urdfs():
    """Name -> (text, tip) of URDFs that other software made."""
    return {path.stem: path.read_text() for path in sorted(URDFS.glob("*.urdf"))}
