// SPDX-License-Identifier: MIT
// One heavy still as a job type of Flamenco 3: each task renders one part of the picture, and the last one merges them.
// It is set up as flamenco.js.
const JOB_TYPE = {
    label: "farlight still",
    description: "Render one heavy picture of a model by parts with farlight",
    settings: [
        { key: "model", type: "string", subtype: "file_path", required: true, description: "The model's file" },
        { key: "output", type: "string", subtype: "file_path", required: true,
          description: "The picture, such as /shared/still.exr; its parts go into /shared/still.exr.parts" },
        { key: "parts", type: "int32", default: 8, description: "Tasks that the picture is divided into, up to 512" },
        { key: "options", type: "string", default: "--size 3840x2160 --samples 1024 --integrator path",
          description: "Further options of farlight render" },
    ],
};

function compileJob(job) {
    const settings = job.settings, files = [];
    const merge = author.Task("merge", "misc");
    for (let part = 1; part <= settings.parts; part++) {
        const file = `${settings.output}.parts/${part}-of-${settings.parts}.exr`;
        const task = author.Task(`render ${part}/${settings.parts}`, "misc");
        task.addCommand(author.Command("exec", {
            exe: "{farlightNode}",
            args: ["{farlight}", "render", "--part", `${part}/${settings.parts}`, "-o", file, "--parents", "--resume", "--progress", "lines",
                   "--retry-for", "5", ...settings.options.split(" ").filter((word) => word !== ""), "--", settings.model],
        }));
        job.addTask(task);
        merge.addDependency(task);
        files.push(file);
    }
    merge.addCommand(author.Command("exec", { exe: "{farlight}", args: ["merge", "-o", settings.output, "--", ...files] }));
    job.addTask(merge);
}
