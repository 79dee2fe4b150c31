// SPDX-License-Identifier: MIT
// Compiles a job type as Flamenco Manager does, with its names `author` and `frameChunker`, and prints the tasks as JSON.
// Usage: flamenco_compile.js JOB-TYPE.js SETTINGS-AS-JSON
const fs = require("fs");
const vm = require("vm");

class Task {
    constructor(name, type) { this.name = name; this.type = type; this.commands = []; this.dependencies = []; }
    addCommand(command) { this.commands.push(command); }
    addDependency(task) { this.dependencies.push(task.name); }
}

const context = vm.createContext({
    author: { Task: (name, type) => new Task(name, type), Command: (name, parameters) => ({ name, parameters }) },
    frameChunker: (frames, size) => {
        const [first, last] = frames.split("-").map(Number), chunks = [];
        for (let begin = first; begin <= last; begin += size)
            chunks.push(begin < last ? `${begin}-${Math.min(begin + size - 1, last)}` : `${begin}`);
        return chunks;
    },
});
const settings = JSON.parse(process.argv[3]);
const tasks = [];
vm.runInContext(fs.readFileSync(process.argv[2], "utf8") + "\nthis.type = JOB_TYPE; this.compile = compileJob;", context);
for (const setting of context.type.settings)
    if (setting.required && !(setting.key in settings))
        throw new Error(`setting ${setting.key} is missing`);
context.compile({ settings, addTask: (task) => tasks.push(task) });
// The manager's variables.
const programs = { "{farlight}": "farlight", "{farlightNode}": "farlight-node" };
for (const { commands } of tasks)
    for (const { parameters } of commands) {
        if (!(parameters.exe in programs))
            throw new Error(`${parameters.exe} is no variable`);
        parameters.exe = programs[parameters.exe];
        parameters.args = parameters.args.map((word) => programs[word] || word);
    }
console.log(JSON.stringify(tasks));
