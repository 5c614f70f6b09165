// The recipe of the bed on the page, for `shakebed run`. Quantities are written so that the program reads the same
// numbers as the engine of the page: the same seed gives the same trajectory.
export function recipeOf(settings) {
  const surface = { restitution: settings.restitution, friction: settings.friction };
  const sides = settings.periodic ? { kind: "periodic" } : { kind: "hard", restitution: settings.restitution };
  return {
    name: "live-bed",
    stages: [
      {
        stage: "simulate",
        id: "bed",
        seed: settings.seed,
        disks: { count: settings.count, diameter: `${settings.diameter} m`, ...surface, inertia: "sphere" },
        box: { width: `${settings.width} m`, sides },
        floor: { motion: "sinusoidal", gamma: settings.gamma, frequency: `${settings.frequency} Hz`, ...surface },
        start: { kind: settings.hexagonal ? "hexagonal" : "random" },
        ...(settings.hexagonal ? {} : { start_temperature: "0 m" }),
        settle: `${settings.settle} s`,
        measure: "20 s",
        replicas: 4,
        frames: { count: 640, phases: 32 },
      },
      { stage: "fit", from: "bed", model: "enskog-rectangle" },
    ],
  };
}
