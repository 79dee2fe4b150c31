// SPDX-License-Identifier: MIT
// An animation as a job type of Flamenco 3; it belongs into the folder `scripts` beside flamenco-manager.
// Each task renders neighbouring frames with the daemon of its worker's GPU; the last one checks all of them.
// flamenco-manager.yaml says where the programs are on each platform, as for {blender}:
//   variables:
//     farlight: {values: [{platform: linux, value: /usr/bin/farlight}]}
//     farlightNode: {values: [{platform: linux, value: /usr/bin/farlight-node}]}
// and, as variables with is_twoway: true, where shared folders are: the manager puts them into the settings of a job.
const JOB_TYPE = {
    label: "farlight animation",
    description: "Render a model's animation with farlight",
    settings: [
        { key: "model", type: "string", subtype: "file_path", required: true, description: "The model's file" },
        { key: "frames", type: "string", required: true, default: "1-120", description: "Frames, such as 1-120" },
        { key: "chunk_size", type: "int32", default: 8, description: "Frames of one task" },
        { key: "output", type: "string", subtype: "file_path", required: true,
          description: "Pictures, such as /shared/frames/%04d.exr" },
        { key: "options", type: "string", default: "--samples 16", description: "Further options of farlight animate" },
    ],
};

// Of all frames: an orbit or a dolly lasts as long as the range that is given, so that a range of its own would be another path.
function animate(settings, part) {
    return author.Command("exec", {
        exe: "{farlightNode}",
        args: ["{farlight}", "animate", "--frames", settings.frames, "--chunk", part, "-o", settings.output, "--parents", "--resume",
               "--digests", "--progress", "lines", "--retry-for", "5", ...settings.options.split(" ").filter((word) => word !== ""), "--", settings.model],
    });
}

function compileJob(job) {
    const settings = job.settings;
    const verify = author.Task("verify", "misc");
    verify.addCommand(author.Command("exec", {
        exe: "{farlight}", args: ["verify", "--frames", settings.frames, "--", settings.output],
    }));
    const parts = frameChunker(settings.frames, settings.chunk_size).length;
    for (let part = 1; part <= parts; part++) {
        const task = author.Task(`render ${part}/${parts}`, "misc");
        task.addCommand(animate(settings, `${part}/${parts}`));
        job.addTask(task);
        verify.addDependency(task);
    }
    job.addTask(verify);
}
