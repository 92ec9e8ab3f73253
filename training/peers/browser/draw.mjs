// node draw.mjs JOB.json SCENE.glb PICTURE.f32: serves the page and its scene, opens it in Chromium, keeps the picture that it sends.
import fs from "node:fs";
import http from "node:http";
import path from "node:path";
import puppeteer from "puppeteer-core";

const [job, glb, picture] = process.argv.slice(2), here = import.meta.dirname;
const server = http.createServer((request, response) => {
    if (request.method === "POST") {
        const parts = [];
        request.on("data", (p) => parts.push(p)).on("end", () => { fs.writeFileSync(picture, Buffer.concat(parts)); response.end(); });
        return;
    }
    const url = request.url.split("?")[0];
    const file = { "/": path.join(here, "page.html"), "/job.json": job, "/scene.glb": glb }[url] ?? path.join(here, "node_modules", path.normalize(url));
    response.setHeader("Content-Type", { ".html": "text/html", ".js": "text/javascript", ".json": "application/json" }[path.extname(file)] ?? "application/octet-stream");
    fs.createReadStream(file).on("error", () => { response.statusCode = 404; response.end(); }).pipe(response);
});
await new Promise((ready) => server.listen(0, "127.0.0.1", ready));
const args = ["--no-sandbox", "--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader", "--enable-unsafe-swiftshader"];
const browser = await puppeteer.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", headless: true, args, protocolTimeout: 580000 });
try {
    const page = await browser.newPage();
    page.on("console", (m) => ["error", "warn"].includes(m.type()) && console.error(m.text()));
    page.on("pageerror", (e) => console.error(String(e)));
    await page.goto(`http://127.0.0.1:${server.address().port}/`);
    await page.waitForFunction("window.done", { timeout: 570000, polling: 500 });
    console.log(JSON.stringify({ ...(await page.evaluate("window.done")), chromium: await browser.version() }));
} finally {
    await browser.close();
    server.close();
}
