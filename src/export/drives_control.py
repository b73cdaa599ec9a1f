"""What MuJoCo's model of these drives cannot hold, put in before every step (numpy, MuJoCo 3.5 or newer).

    model = mujoco.MjModel.from_xml_path("arm.xml")  # of `calib export --format mjcf`, the same run
    data = mujoco.MjData(model)
    control = Control(model)  # it delays commands itself and takes the model's delays out
    control.begin(data)  # at rest, where data.qpos is
    while ...:
        control.send(data, command)  # rad, of the joints in the order of NAMES; and commanded speeds, rad/s, where `kd_on_error` is 1
        mujoco.mj_step(model, data)
        control.angles(data)  # as the encoders see them
"""

import mujoco
import numpy as np

NAMES = {{ names }}
ARM = {{ arm }}
# Of each joint; SI.
DRIVE = {{ drive }}
# Of each joint: waves a turn, Nm of cosine and sine; joint (from 0) and share of its drive's torque; what a curve follows, whose, whether it is
# dry friction, first knot, way to the next, Nm at the knots.
RIPPLES = {{ ripples }}
COUPLINGS = {{ couplings }}
CURVES = {{ curves }}
# s, in which the supply follows the load, and friction the gear's.
SAG_LAG, LOAD_LAG = {{ lags }}
NONE = 1e9  # of a limit
STILL = 1e-4  # rad/s, slower than which a joint rests


class Control:
    def __init__(self, model):
        self.model = model
        number = lambda kind, name: mujoco.mj_name2id(model, kind, name)
        joints = [number(mujoco.mjtObj.mjOBJ_JOINT, name) for name in NAMES]
        gears = [number(mujoco.mjtObj.mjOBJ_JOINT, name + "_gear") for name in NAMES]
        self.q, self.v = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        self.geared = [j for j in range(len(NAMES)) if gears[j] >= 0]
        gears = [gears[j] for j in self.geared]
        self.gear_q, self.gear_v = model.jnt_qposadr[gears], model.jnt_dofadr[gears]
        self.angle = [number(mujoco.mjtObj.mjOBJ_ACTUATOR, name) for name in NAMES]
        speed = [number(mujoco.mjtObj.mjOBJ_ACTUATOR, name + "_speed") for name in NAMES]
        self.speed = {j: at for j, at in enumerate(speed) if at >= 0}
        model.actuator_delay[:] = 0
        for name, values in DRIVE.items():
            setattr(self, name, np.array([NONE if x is None else x for x in values], float))
        for k, j in enumerate(self.geared):
            if self.gear_play[j] > 0:  # flanks are springs, not contacts
                model.jnt_limited[gears[k]], model.dof_damping[self.gear_v[k]] = 0, 0
        self.strength = [model.actuator_gainprm.copy(), model.actuator_biasprm.copy(), model.jnt_actfrcrange.copy()]
        self.integral, self.drawn = self.integral_start.clip(-self.integral_limit, self.integral_limit), np.zeros(2)

    def begin(self, data, since=0.0):
        """A motion from rest, `since` s after a recording began, when the joints were cold; drives' integrals run on."""
        mujoco.mj_forward(self.model, data)
        weight = data.qfrc_bias[self.v]
        for k, j in enumerate(self.geared):
            carried = data.qfrc_bias[self.gear_v[k]]
            data.qpos[self.gear_q[k]] = -carried / self.gear_stiffness[j] - 0.5 * self.gear_play[j] * np.sign(carried)
        self.cold, self.slot, self.sent = data.time - since, -1, []
        self.load, self.before, self.bent = weight.copy(), np.zeros((2, len(NAMES))), None

    def angles(self, data):
        seen = data.qpos[self.q].copy()
        seen[self.geared] += self.gear_encoder_on_link[self.geared] * data.qpos[self.gear_q]
        return seen

    def commanded(self, data, command, speed):
        """Commands held, delayed, slewed: the mean over the next step."""
        h = self.model.opt.timestep
        command, speed = np.array(command, float), np.zeros(len(NAMES)) if speed is None else np.array(speed, float)
        if hold := ARM["command_hold"]:
            slot = np.floor((data.time - self.cold) / hold + 1e-6)
            if slot > self.slot:
                last = self.taken[0] if self.sent else command
                self.slot, self.taken = slot, (command, (command - last) / hold)
            command, speed = self.taken
        if not self.sent:
            self.set_point = command.copy()
            self.sent = [(command, 0 * speed)] * (int(self.command_delay.max() / h) + 2)
        self.sent = [*self.sent[1:], (command, speed)]
        whole, share = np.divmod(self.command_delay / h, 1)
        past = lambda k, what: np.array([self.sent[-1 - int(back)][what][j] for j, back in enumerate(whole + k)])
        command, speed = [(1 - share) * past(0, what) + share * past(1, what) for what in (0, 1)] if whole.any() or share.any() else self.sent[-1]
        far, way = command - self.set_point, self.speed_limit * h
        slews = np.abs(far) >= way
        mean = np.where(slews, self.set_point + 0.5 * np.copysign(way, far), command - 0.5 * far * np.abs(far) / way)
        self.set_point = np.where(slews, self.set_point + np.copysign(way, far), command)
        return mean, speed

    def send(self, data, command, speed=None):
        m, h, time = self.model, self.model.opt.timestep, data.time - self.cold
        q, v = data.qpos[self.q], data.qvel[self.v]
        a = (v - self.before[0]) / h if self.bent is not None else 0 * v
        angle, speed = self.commanded(data, command, speed)
        # All but gain and damping are those of the middle of the step.
        time, rotor, ahead = time + 0.5 * h, q + 0.5 * h * v, np.where(np.abs(v) > STILL, v + 0.5 * h * a, 0)
        twist, rate = 0 * q, 0 * q
        rate[self.geared] = data.qvel[self.gear_v]
        twist[self.geared] = data.qpos[self.gear_q] + 0.5 * h * data.qvel[self.gear_v]
        link, link_ahead, on_link = rotor + twist, ahead + rate, self.gear_encoder_on_link > 0
        drawn = self.drawn[0] + (self.drawn[1] - self.drawn[0]) * 0.5 * h / SAG_LAG
        sag = 1 - np.clip(ARM["voltage_sag"] * drawn, 0, 0.9)
        # What a drive gives.
        error = angle + self.command_offset - np.where(on_link, link, rotor)
        before, most = self.integral, self.integral_limit
        self.integral = np.clip(before + self.integral_gain * error * h, -most, most)
        integral = 0.5 * (before + self.integral)
        band = error.clip(-self.dead_band, self.dead_band)
        damped = np.where(self.kd_on_error > 0, speed, 0) - np.where(on_link, link_ahead, ahead)
        limit = self.torque_limit * sag
        given = np.clip(sag * (self.kp * (error - band) + self.kd * damped + integral), -limit, limit)
        total = np.abs(given).sum()
        self.drawn = np.array([(self.drawn[0] * (1 - 0.5 * h / SAG_LAG) + total * h / SAG_LAG) / (1 + 0.5 * h / SAG_LAG), total])
        data.ctrl[self.angle] = angle - band + (integral - np.where(on_link, self.kd * rate, 0)) / self.kp - np.where(on_link, twist, 0)
        for j, at in self.speed.items():
            data.ctrl[at] = speed[j]
        if ARM["voltage_sag"]:
            m.actuator_gainprm[:], m.actuator_biasprm[:], m.jnt_actfrcrange[:] = [sag * numbers for numbers in self.strength]
        # Torques over something.
        torque, dry_curve = 0 * q, 0 * q
        for j in range(len(NAMES)):
            torque[j] += sum(c * np.cos(w * rotor[j]) + s * np.sin(w * rotor[j]) for w, c, s in RIPPLES[j])
            torque[j] += sum(share * given[by] for by, share in COUPLINGS[j])
            for over, of, dry, first, step, values in CURVES[j]:
                x = {"angle": link[of], "speed": abs(link_ahead[of]), "velocity": link_ahead[of], "acceleration": a[of], "time": time}[over]
                (dry_curve if dry else torque)[j] += curve((x - first) / step, values)
        # Friction.
        cold = np.exp(-time / self.warm_up_time)
        m.dof_damping[self.v] = self.damping * (1 + self.warm_up_share_viscous * cold).clip(0)
        dry = self.friction + self.stribeck_friction * np.exp(-((ahead / self.stribeck_speed) ** 2))
        dry = dry * (1 + self.warm_up_share * cold) + dry_curve
        dry += np.where(given * ahead < 0, self.load_friction_back, self.load_friction_driving) * np.abs(given)
        if self.gear_friction_driving.any() or self.gear_friction_back.any():
            asked, moving = np.zeros(m.nv), np.zeros(m.nv)
            moving[self.v] = a
            mujoco.mj_mulM(m, data, asked, moving)
            load = data.qfrc_bias[self.v] + asked[self.v] - m.dof_armature[self.v] * a
            self.load += (load - self.load) * min(h / LOAD_LAG, 1)
        ways = [np.where(self.load * way < 0, self.gear_friction_back, self.gear_friction_driving) for way in (1, -1)]
        forward, back = [(dry + share * np.abs(self.load)).clip(0) for share in ways]
        bends = self.presliding > 0
        travel = np.where(bends, self.presliding, 1)
        if self.bent is None:
            held = self.kp * (self.set_point + self.command_offset - q) - self.load - self.spring_stiffness * (q - self.spring_reference)
            self.bent = np.clip(held / self.friction.clip(1e-9), -1, 1)
        else:
            self.bent = bend(self.bent, 0.5 * (v + self.before[0]) * h / travel)
        torque -= np.where(bends, np.where(ahead < 0, back, forward) * bend(self.bent, 0.5 * h * ahead / travel), 0.5 * (forward - back))
        m.dof_frictionloss[self.v] = np.where(bends, 0, 0.5 * (forward + back))
        data.qfrc_applied[self.v] = torque
        for k, j in enumerate(self.geared):
            half = 0.5 * self.gear_play[j]
            if half > 0 and abs(twist[j]) > half:
                way = twist[j] - np.clip(twist[j], -half, half)
                data.qfrc_applied[self.gear_v[k]] = -self.gear_stiffness[j] * way - self.gear_damping[j] * rate[j]
            elif half > 0:
                data.qfrc_applied[self.gear_v[k]] = 0
        self.before = np.array([v, a])


def curve(at, values):
    """A curve by its values at knots 0, 1 .., smooth between them (Catmull and Rom), held beyond them."""
    at = min(max(at, 0), len(values) - 1)
    k = min(int(at), len(values) - 2)
    a, b = values[k : k + 2]
    before = values[k - 1] if k > 0 else 2 * a - b
    after = values[k + 2] if k + 2 < len(values) else 2 * b - a
    t, m, n = at - k, 0.5 * (b - before), 0.5 * (after - a)
    return a + t * (m + t * (3 * (b - a) - 2 * m - n + t * (2 * (a - b) + m + n)))


def bend(bent, way):
    """Friction that bends before it slides: how far it is bent after a way, in travels."""
    return (bent + way) / (1 + np.abs(way))
