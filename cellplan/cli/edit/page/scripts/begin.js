// Begin: take the token of the address, open the session, follow its events.

async function begin() {
  followSystemTheme();
  const token = takenToken();
  const say = (text) => {
    byId("gone-text").textContent = text;
    byId("gone").hidden = false;
  };
  if (!token) return say("No token in the address: open the page by the file that cellplan edit names in the terminal.");
  let app = null;
  const client = new Client(token, {
    answer: (answer) => app.apply(answer),
    event: (event) => app.outcome.take(event),
    refused: (text) => (app ? app.refused(text) : say(text)),
    gone: () => {
      const text = "The session of cellplan edit has ended or does not answer. What was changed stands below: paste it behind the command.";
      if (app) app.leave(text);
      else say(text);
    },
  });
  await client.guarded(async () => {
    app = window.app = new LiveApp(await client.record("/open", {}), client);
  });
  if (app) client.follow();
  return undefined;
}

begin();
