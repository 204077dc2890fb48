"""The folders of the library, from the ground up: each may use itself and what stands before it."""
FOLDERS = ["base", "algebra", "expression", "model", "linear", "joint", "loop", "effect", "dynamics", "constraint", "reduction", "closure", "mechanism", "derivative",
           "control", "identification", "integrator", "motion", "contact", "compile", "simulation", "batch", "sensitivity", "analysis", "build", "study", "mesh", "document", "scene", "robot", "picture", "codegen"]
