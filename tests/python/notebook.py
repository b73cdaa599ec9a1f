# %% [markdown]
# # What is wrong with this arm?
# A recording of a laser tracker as arrays: joints in rad, points in mm. It was simulated with a concealed cause.

# %%
import calib
import matplotlib.pyplot as plt
import numpy as np
from recorded import EXAMPLE, recording

joints, points, held_out, columns = recording("r01")
robot = calib.Robot.from_file(EXAMPLE / "r01" / "robot.json")

# %% [markdown]
# ## Identify the geometry, and look at what remains over time

# %%
geometry = {"effects": ["base_frame", "tool_offset", "joint_offset", "link_geometry"]}
model = robot.identify(joints, points, "leica_at960", held_out=held_out, settings=geometry, **columns)
left = np.linalg.norm(points - model.predict(joints, **columns), axis=1)
figure, axes = plt.subplots(figsize=(8, 3.2), layout="constrained")
axes.plot(columns["time_s"][~held_out], left[~held_out], ".", label="fitted")
axes.plot(columns["time_s"][held_out], left[held_out], "o", mfc="none", label="held out")
axes.set(xlabel="time, s", ylabel="error, mm", title=f"{robot.name}, geometry identified")
axes.legend()
figure.savefig("residuals.png", dpi=120)

# %% [markdown]
# ## Which cause explains it
# In a notebook the last expression shows the table of causes.

# %%
diagnosis = robot.diagnose(joints, points, "leica_at960", held_out=held_out, **columns)
for finding in diagnosis.findings:
    print(f"{finding['statement']} (probability {finding['probability']:.2f})")

# %%
cells = diagnosis.cells
before = cells["moment"] == "before"
places, follows = list(dict.fromkeys(cells["place"])), list(dict.fromkeys(cells["follows"]))
size = np.full((len(places), len(follows)), np.nan)
for place, variable, mm in zip(cells["place"][before], cells["follows"][before], cells["explains_mm"][before]):
    at = places.index(place), follows.index(variable)
    size[at] = np.nanmax([size[at], mm]) if np.isfinite([size[at], mm]).any() else np.nan
figure, axes = plt.subplots(figsize=(8, 4.5), layout="constrained")
image = axes.imshow(1e3 * size, aspect="auto", cmap="viridis")
axes.set_xticks(range(len(follows)), follows, rotation=60, ha="right")
axes.set_yticks(range(len(places)), places)
figure.colorbar(image, label="could explain, um rms at the tool")
figure.savefig("causes.png", dpi=120)
diagnosis
