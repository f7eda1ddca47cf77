# Runs one case in YADE: reads case.json and start.csv of the folder it runs in, prints states and loop time.
import csv
import json
import math
import time

from yade import *

case = json.load(open("case.json"))
rows = [[float(w) for w in line] for line in csv.reader(open("start.csv"))]
law, dt = case["law"], case["timestep"]
gravity = Vector3(*case["gravity"])
low, high = case["lower"], case["upper"]

FREE, FROZEN = 1, 2
if any(case["periodic"]):
    O.periodic = True
    # The cell starts at the origin; an axis that is not periodic gets room on both sides.
    size = [high[k] - low[k] if case["periodic"][k] else 4 * (high[k] - low[k]) for k in range(3)]
    shift = Vector3(*[-low[k] if case["periodic"][k] else size[k] / 4 - low[k] for k in range(3)])
    O.cell.setBox(*size)
else:
    shift = Vector3(0, 0, 0)

density = rows[0][1]
if law["kind"] == "hooke":
    # Two equal materials make a contact of the same stiffness in YADE's rule 2ab/(a+b), where a and b are
    # half of what is given here; dashpots likewise. The reduced mass of two free grains is half a grain's,
    # that of a free and a frozen one the whole: the frozen ones' own dashpot is therefore rigid.
    mass = 4 / 3 * math.pi * rows[0][0] ** 3 * density
    spring = dict(kn=2 * law["stiffness"], ks=2 * law["tangential"], cs=0.0, frictionAngle=math.atan(law["friction"]))
    material = O.materials.append(ViscElMat(density=density, cn=law["damping"] * mass, **spring))
    frozen = O.materials.append(ViscElMat(density=density, cn=1e15, **spring))
    physics, contact = Ip2_ViscElMat_ViscElMat_ViscElPhys(), Law2_ScGeom_ViscElPhys_Basic()
else:
    material = frozen = O.materials.append(
        FrictMat(young=law["young"], poisson=law["poisson"], density=density, frictionAngle=math.atan(law["friction"]))
    )
    # Damping ratio of Tsuji's dashpot, of both directions against their own tangent stiffness.
    log = math.log(law["restitution"])
    ratio = math.sqrt(5 / 6) * -log / math.sqrt(math.pi**2 + log**2)
    physics = Ip2_FrictMat_FrictMat_MindlinPhys(betan=ratio, betas=ratio)
    contact = Law2_ScGeom_MindlinPhys_Mindlin()

free = []
for radius, _, held, x, y, z, vx, vy, vz, wx, wy, wz in rows:
    at = Vector3(x, y, z) + shift
    body = sphere(at, radius, material=frozen if held else material, fixed=bool(held))
    index = O.bodies.append(body)
    O.bodies[index].mask = FREE | FROZEN if held else FREE
    if not held:
        O.bodies[index].state.vel = Vector3(vx, vy, vz)
        O.bodies[index].state.angVel = Vector3(wx, wy, wz)
        free.append(index)
for wall in case["walls"]:
    place = Vector3(0, 0, 0)
    place[wall["axis"]] = wall["position"]
    O.bodies.append(utils.wall(place, wall["axis"], sense=1 if wall["grains_above"] else -1, material=material))

O.engines = [
    ForceResetter(),
    InsertionSortCollider(
        [Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()],
        # Bounds of both grains grow: half the pair distance each.
        verletDist=0.5 * case["skin"],
        avoidSelfInteractionMask=FROZEN,
    ),
    InteractionLoop([Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()], [physics], [contact]),
    NewtonIntegrator(damping=0, gravity=gravity),
]

total = sum(O.bodies[i].state.mass for i in free)


def kick(i, time_step):
    # Threads add up forces apart: whoever asks first has to ask for the sum.
    state = O.bodies[i].state
    return time_step * (O.forces.f(i) / state.mass + gravity)


def report(step):
    # Velocities live half a step back; the forces at hand are one step old.
    O.forces.f(free[0], True)
    kinetic = sum(
        0.5 * O.bodies[i].state.mass * (O.bodies[i].state.vel + kick(i, 0.5 * dt)).squaredNorm() for i in free
    )
    height = sum(O.bodies[i].state.mass * O.bodies[i].state.pos[2] for i in free) / total - shift[2]
    print("state %d %.12g %.12g" % (step, kinetic, height), flush=True)


print("version YADE", yade.config.version)
# Forces of the start, without motion: the start's velocities are then put half a step back.
O.dt = 1e-30
O.step()
O.forces.f(free[0], True)
for i in free:
    state = O.bodies[i].state
    state.vel -= kick(i, 0.5 * dt)
    state.angVel -= 0.5 * dt * Vector3(*[O.forces.t(i)[k] / state.inertia[k] for k in range(3)])
O.dt = dt
real = [c for c in O.interactions if c.isReal]
print("contacts", len(real), {k: getattr(real[0].phys, k) for k in ("kn", "ks", "cn", "cs") if hasattr(real[0].phys, k)})
first_step = O.iter

steps = wall = cpu = 0
while O.iter - first_step < case["warm_up"] + case["steps"]:
    before = O.iter - first_step
    started, used = time.perf_counter(), time.process_time()
    O.run(case["every"], True)
    if before >= case["warm_up"]:
        wall += time.perf_counter() - started
        cpu += time.process_time() - used
        steps += case["every"]
    report(O.iter - first_step)
print("loop %d %.6f %.6f" % (steps, wall, cpu), flush=True)
