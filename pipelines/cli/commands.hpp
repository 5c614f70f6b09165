// The commands of the program. Each is added by the file of its name, with its options, examples and work.
#pragma once

namespace shakebed::pipelines {

class Program;

void add_reproduce(Program& program);
void add_run(Program& program);
void add_fit_images(Program& program);
void add_infer_bed(Program& program);
void add_fit_profile(Program& program);
void add_theory(Program& program);
void add_map(Program& program);
void add_audit(Program& program);
void add_init(Program& program);
void add_live(Program& program);
void add_schema(Program& program);
void add_reference(Program& program);
void add_validate(Program& program);
void add_explain(Program& program);
void add_graph(Program& program);
void add_status(Program& program);
void add_verify(Program& program);
void add_rerun(Program& program);
void add_clean(Program& program);
void add_bench(Program& program);
void add_submit(Program& program);

}  // namespace shakebed::pipelines
